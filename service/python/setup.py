"""Makes the messages from proto/ with protoc, and packs proto/ into source packages; all else is in pyproject.toml."""

import pathlib
import re
import shutil
import subprocess

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = pathlib.Path(__file__).resolve().parent
PROTO = next(folder for folder in (HERE / "proto", HERE.parent.parent / "proto") if folder.is_dir())
MESSAGES = ["rcs/v1/options.proto", "rcs/v1/job.proto", "rcs/v1/service.proto"]


class BuildMessages(build_py):
    def run(self) -> None:
        protoc = shutil.which("protoc")
        if protoc is None:
            raise SystemExit("protoc is missing: install protobuf-compiler")
        super().run()
        wire = pathlib.Path(self.build_lib) / "rcsplat" / "wire"
        wire.mkdir(parents=True, exist_ok=True)
        subprocess.run([protoc, f"-I{PROTO}", f"--python_out={wire}", f"--pyi_out={wire}", *MESSAGES], check=True)
        # The modules import each other from the top; they lie within the package here.
        for made in wire.rglob("*_pb2.py*"):
            text = made.read_text().replace("from rcs.v1 import", "from rcsplat.wire.rcs.v1 import")
            # What mypy --strict misses in protoc's types.
            text = re.sub(r"(?<! as )\b_Mapping\b(?!\[)", "_Mapping[str, object]", text)
            made.write_text(text.replace("__slots__ = []", "__slots__: list[str] = []"))


class PackMessages(sdist):
    def make_release_tree(self, base_dir: str, files: "list[str]") -> None:
        super().make_release_tree(base_dir, files)
        for message in MESSAGES:
            packed = pathlib.Path(base_dir) / "proto" / message
            packed.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(PROTO / message, packed)


setup(cmdclass={"build_py": BuildMessages, "sdist": PackMessages})

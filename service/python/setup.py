"""Makes the messages from proto/ with protoc; all else is in pyproject.toml."""

import pathlib
import shutil
import subprocess

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = pathlib.Path(__file__).resolve().parent
PROTO = HERE.parent.parent / "proto"
MESSAGES = ["rcs/v1/options.proto", "rcs/v1/job.proto", "rcs/v1/service.proto"]


class BuildMessages(build_py):
    def run(self) -> None:
        protoc = shutil.which("protoc")
        if protoc is None:
            raise SystemExit("protoc is missing: install protobuf-compiler")
        if not PROTO.is_dir():
            raise SystemExit(f"{PROTO} is missing: install from a checkout, as in pip install ./service/python")
        super().run()
        wire = pathlib.Path(self.build_lib) / "rcsplat" / "wire"
        wire.mkdir(parents=True, exist_ok=True)
        subprocess.run([protoc, f"-I{PROTO}", f"--python_out={wire}", f"--pyi_out={wire}", *MESSAGES], check=True)
        # The modules import each other from the top; they lie within the package here.
        for made in wire.rglob("*_pb2.py*"):
            made.write_text(made.read_text().replace("from rcs.v1 import", "from rcsplat.wire.rcs.v1 import"))


setup(cmdclass={"build_py": BuildMessages})

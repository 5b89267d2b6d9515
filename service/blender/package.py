#!/usr/bin/env python3
"""Builds the extension for Blender with the wheels that it needs: the client, and protobuf in pure Python.

    service/blender/package.py -o rcsplat_render.zip

Blender 4.2 and later install the file as an extension, earlier ones as an add-on. Needs protoc and a package index.
"""

import argparse
import pathlib
import shutil
import subprocess
import sys
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent

def pip(*words: "str | pathlib.Path") -> None:
    own = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*own, *map(str, words)], check=True)


def build_client(wheels: pathlib.Path, work: pathlib.Path) -> None:
    """In a copy, so that nothing is left in the source."""
    for part in ("service/python", "proto"):
        shutil.copytree(ROOT / part, work / part)
    pip("wheel", "--no-deps", "--wheel-dir", wheels, work / "service/python")


def build(target: pathlib.Path) -> None:
    with tempfile.TemporaryDirectory(prefix="rcs-blender-") as name:
        work = pathlib.Path(name)
        package = work / "rcsplat_render"
        shutil.copytree(HERE / "rcsplat_render", package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copyfile(ROOT / "LICENSE", package / "LICENSE")
        wheels = package / "wheels"
        wheels.mkdir()
        build_client(wheels, work / "source")
        # In Python alone, so that one file is for all platforms.
        pip("download", "--no-deps", "--only-binary=:all:", "--platform", "any", "--dest", wheels, "protobuf>=5,<6")
        manifest = package / "blender_manifest.toml"
        named = "".join(f'    "./wheels/{wheel.name}",\n' for wheel in sorted(wheels.iterdir()))
        head, mark, tail = manifest.read_text().partition("# service/blender/package.py writes")
        assert mark, "the manifest lacks the place for its wheels"
        manifest.write_text(f"{head}wheels = [\n{named}]\n{tail[tail.index(chr(10)):]}")
        temporary = target.with_name(f".{target.name}")
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as file:
            for path in sorted(package.rglob("*")):
                if path.is_file():
                    file.write(path, pathlib.Path("rcsplat_render") / path.relative_to(package))
        temporary.replace(target)


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("rcsplat_render.zip"))
    given = words.parse_args()
    build(given.output.resolve())
    print(given.output)


if __name__ == "__main__":
    main()

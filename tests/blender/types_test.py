"""mypy --strict and ruff find nothing in the add-on. types_test.py; exit code 77 where no package index is reached."""

import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def main():
    with tempfile.TemporaryDirectory(prefix="rcs-blender-types-") as name:
        folder = pathlib.Path(name)
        for part in ("service/python", "service/blender", "proto"):
            shutil.copytree(ROOT / part, folder / part)
        subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
        tools = folder / "venv/bin"
        wanted = ["mypy", "ruff", "types-protobuf", "numpy", folder / "service/python"]
        made = subprocess.run([tools / "python", "-m", "pip", "install", "--quiet", "--retries", "1", *wanted],
                              capture_output=True, text=True)
        if made.returncode != 0:
            print("skipped:", made.stderr)
            return 77
        for words in ([tools / "mypy"], [tools / "ruff", "check", "."]):
            if subprocess.run(words, cwd=folder / "service/blender").returncode != 0:
                return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

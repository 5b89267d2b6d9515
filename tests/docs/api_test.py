#!/usr/bin/env python3
"""Every symbol of the public headers is described, and nothing there that doxygen takes for wrong; 77 without it."""
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[2]
SKIPPED = 77


def warnings_of(include):
    """What doxygen says of the headers in a folder, with the settings of the project's own reference."""
    with tempfile.TemporaryDirectory() as out:
        settings = (ROOT / "docs/Doxyfile").read_text()
        settings += f'INPUT = "{include}"\nOUTPUT_DIRECTORY = "{out}"\nWARN_AS_ERROR = NO\n'
        told = subprocess.run(["doxygen", "-"], input=settings, text=True, capture_output=True, cwd=ROOT, check=True)
    return told.stderr.splitlines()


def main():
    if shutil.which("doxygen") is None:
        print("doxygen is not installed")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "bare.h").write_text("/// A place.\nnamespace rcs {\nstruct Bare { int bare; };\n}\n")
        if not any("not documented" in line for line in warnings_of(folder)):
            print("a symbol without a description is not found: this test sees nothing")
            return 1
    found = warnings_of(ROOT / "librcs/include/rcs")
    print("\n".join(found) or "every symbol is described")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

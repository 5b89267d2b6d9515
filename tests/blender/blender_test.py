"""Builds the extension for Blender, installs it and runs cases/ in Blender, each in a process of its own.

blender_test.py RCSPLAT [CASE...]; Blenders are those of $RCS_BPY_PYTHON (interpreters with the package bpy, parted by
colons) and of $RCS_BLENDER or the path. Exit code 77 where there is none, or no package index can be reached.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "service/blender/package.py"
SECONDS = 400


def blenders():
    """(name, words before a script's path) of each."""
    for python in filter(None, os.environ.get("RCS_BPY_PYTHON", "").split(":")):
        yield python, [python]
    program = shutil.which(os.environ.get("RCS_BLENDER", "blender"))
    if program:
        yield program, [program, "--background", "--factory-startup", "--python-exit-code", "1", "--python"]


def run_case(rcsplat, words, case, folder):
    """What it said, where it failed; else nothing."""
    home = folder / "home"
    home.mkdir(parents=True)
    # Blender looks for its Python along the path, and may take another one's.
    environment = {**os.environ, "PATH": os.defpath, "HOME": str(home), "XDG_CONFIG_HOME": str(home),
                   "RCSPLAT": rcsplat,
                   "RCSPLAT_SERVER": str(folder / "run/socket"), "RCSPLAT_STATE": str(folder / "state"),
                   "RCS_ADDON": str(folder.parent), "RCS_ZIP": str(folder.parent / "addon.zip"),
                   "RCS_OUT": str(folder), "RCS_CASE": str(case),
                   "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        ended = subprocess.run([*words, str(HERE / "cases/run.py")], env=environment, stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired as late:
        return f"not done after {SECONDS} s: {late.output}"
    said = [line for line in ended.stdout.splitlines() if line.startswith("case:")]
    print("\n".join(said), flush=True)
    held = any(line == "case: all held" for line in said)
    return "" if held else ended.stdout


def main():
    rcsplat, wanted = os.path.abspath(sys.argv[1]), sys.argv[2:]
    found = list(blenders())
    if not found:
        print("skipped: no Blender; RCS_BPY_PYTHON names interpreters with the package bpy")
        return 77
    with tempfile.TemporaryDirectory(prefix="rcs-blender-") as name:
        folder = pathlib.Path(name)
        made = subprocess.run([sys.executable, PACKAGE, "-o", folder / "addon.zip"], capture_output=True, text=True)
        if made.returncode != 0:
            offline = "Could not find a version" in made.stderr or "No matching distribution" in made.stderr
            print("skipped: no wheels can be had" if offline else made.stdout + made.stderr)
            return 77 if offline else 1
        with zipfile.ZipFile(folder / "addon.zip") as file:
            file.extractall(folder)
        failed = 0
        for number, (title, words) in enumerate(found):
            for case in sorted((HERE / "cases").glob("*_case.py")):
                if wanted and case.stem not in wanted:
                    continue
                print(f"{title}: {case.stem}", flush=True)
                said = run_case(rcsplat, words, case, folder / f"{number}-{case.stem}")
                failed += bool(said)
                if said:
                    print(said)
        return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

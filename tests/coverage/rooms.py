#!/usr/bin/env python3
"""Lines that ran, by room: what gcov says of a build folder, as a table.

    rooms.py BUILD [--least PERCENT]    # exit 1 if less of librcs or of service ran
"""

import argparse
import collections
import gzip
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def room_of(file):
    """librcs/src/records/watch.cpp -> librcs/records, librcs/include/rcs/a.h -> librcs/include; None: not ours."""
    try:
        parts = pathlib.Path(file).resolve().relative_to(ROOT).parts
    except ValueError:
        return None
    if parts[0] == "librcs":
        return "librcs/" + (parts[2] if parts[1] == "src" else parts[1])
    if parts[0] == "service":
        return "service/" + (parts[1] if len(parts) > 2 else "main")
    return None


def lines_of(build):
    """{file: {line: times that it ran}} of all objects together."""
    counts = collections.defaultdict(lambda: collections.defaultdict(int))
    data = [str(file.resolve()) for file in build.rglob("*.gcda")]
    if not data:
        sys.exit("no run has left its counts in %s" % build)
    for of_one in data:
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["gcov", "--json-format", of_one], cwd=folder, check=True, capture_output=True)
            for made in pathlib.Path(folder).glob("*.gcov.json.gz"):
                report = json.loads(gzip.decompress(made.read_bytes()))
                for file in report["files"]:
                    path = (pathlib.Path(report["current_working_directory"]) / file["file"]).resolve()
                    if room_of(path) is None:
                        continue
                    for line in file["lines"]:
                        counts[path][line["line_number"]] += line["count"]
    return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--least", type=float, default=0.0, metavar="PERCENT")
    asked = parser.parse_args()
    rooms = collections.defaultdict(lambda: [0, 0])
    for file, lines in lines_of(asked.build).items():
        for name in (room_of(file), room_of(file).split("/")[0] + ", all"):
            rooms[name][0] += sum(count > 0 for count in lines.values())
            rooms[name][1] += len(lines)
    print("| room | lines | ran |\n| --- | --- | --- |")
    for name, (ran, lines) in sorted(rooms.items(), key=lambda room: (", all" in room[0], room[0])):
        print("| %s | %d | %.1f %% |" % (name, lines, 100.0 * ran / lines))
    wholes = [(name, 100.0 * ran / lines) for name, (ran, lines) in rooms.items() if ", all" in name]
    return 1 if any(part < asked.least for _, part in wholes) else 0


if __name__ == "__main__":
    sys.exit(main())

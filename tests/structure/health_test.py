#!/usr/bin/env python3
"""What a project says of itself, held to what it is: notices of third parties, the form of its sources."""

import pathlib
import re
import shutil
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def packages():
    lines = (ROOT / "docker/packages.txt").read_text().splitlines()
    return {word for line in lines for word in line.split("#")[0].split()}


class Notices(unittest.TestCase):
    def test_every_package_has_one_and_no_other(self):
        rows = [row for row in (ROOT / "THIRD_PARTY.md").read_text().splitlines() if row.startswith("| ")][2:]
        noticed = [name for row in rows for name in row.split("|")[1].replace(",", " ").split()]
        self.assertEqual(sorted(noticed), sorted(packages()))
        for row in rows:
            self.assertEqual([cell.strip() == "" for cell in row.split("|")[1:-1]], [False] * 4, row)


class Format(unittest.TestCase):
    def test_sources_are_as_clang_format_leaves_them(self):
        tool = shutil.which("clang-format-19") or shutil.which("clang-format")
        said = subprocess.run([tool, "--version"], capture_output=True, text=True).stdout if tool else ""
        if not re.search(r"version 19\.", said):
            self.skipTest("clang-format 19 is not here")
        # Not those of shaders/, which GLSL reads as well.
        listed = subprocess.run(["git", "ls-files", "librcs/*.h", "service/*.h", "tests/*.h", "*.cpp"], cwd=ROOT,
                                capture_output=True, text=True)
        if listed.returncode != 0:
            self.skipTest("this is no checkout")
        done = subprocess.run([tool, "--dry-run", "--Werror", *listed.stdout.split()], cwd=ROOT, capture_output=True,
                              text=True)
        self.assertEqual(done.returncode, 0, done.stderr[:4000])


if __name__ == "__main__":
    unittest.main()

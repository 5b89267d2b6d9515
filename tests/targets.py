#!/usr/bin/env python3
"""Prints what has to be built for `ctest -R REGEX`, from the arguments that ctest will get; "all" without -R.

    targets.py LIST [ARGUMENT...]    # LIST: build/release/tests/targets.txt
"""

import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
TEST = re.compile(r"^TEST(?:_F|_P)?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.M)
VALUES = re.compile(r"^INSTANTIATE_TEST_SUITE_P\(.*?;$", re.M | re.S)


def regex_of(arguments):
    """@return None: all tests are asked for, or by other means"""
    for i, argument in enumerate(arguments):
        for option in ("-R", "--tests-regex"):
            if argument == option and i + 1 < len(arguments):
                return arguments[i + 1]
            if argument.startswith(option + "=" if option.startswith("--") else option) and argument != option:
                return argument[len(option):].lstrip("=")
    return None


def names_in(name):
    """What a regex may match: the name of the test itself or, of a source file, the names of its tests and what tells
    the instances of one from each other."""
    if not name.endswith(".cpp"):
        return [name]
    text = (HERE / name).read_text()
    return [pathlib.Path(name).stem, *(".".join(found) for found in TEST.findall(text)), *VALUES.findall(text)]


def main():
    regex = regex_of(sys.argv[2:])
    if regex is None:
        print("all")
        return
    wanted = set()
    for line in pathlib.Path(sys.argv[1]).read_text().splitlines():
        name, *targets = line.split()
        if any(re.search(regex, text) for text in names_in(name)):
            wanted.update(targets)
            wanted.add("")  # it was found, even if it takes no target
    print("\n".join(sorted(filter(None, wanted))) if wanted else "all")


if __name__ == "__main__":
    main()

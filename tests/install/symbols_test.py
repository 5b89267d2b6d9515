#!/usr/bin/env python3
"""What librcs.so shows to programs is what symbols.txt lists: RCS_API, and nothing of what it is made from.

    symbols_test.py LIBRARY            # fails where they differ
    symbols_test.py LIBRARY --update   # writes the list: for a change that is meant
"""

import pathlib
import re
import subprocess
import sys

LIST = pathlib.Path(__file__).with_name("symbols.txt")


def symbols(library):
    """Names of functions and types as C++ writes them, the standard library's strings in short."""
    shown = subprocess.run(["nm", "-D", "-C", "--defined-only", "--with-symbol-versions", library], check=True,
                           capture_output=True, text=True).stdout
    names = set()
    for line in shown.splitlines():
        _, kind, name = re.match(r"([0-9a-f]*) +(\w) (.*)", line).groups()
        if kind == "A":  # the version itself
            continue
        name = name.replace("std::__cxx11::basic_string<char, std::char_traits<char>, std::allocator<char> >",
                            "std::string")
        name = name.replace("std::basic_string_view<char, std::char_traits<char> >", "std::string_view")
        names.add(name)
    return names


def main():
    library = sys.argv[1]
    found = symbols(library)
    if "--update" in sys.argv:
        LIST.write_text("".join(name + "\n" for name in sorted(found)))
        return 0
    listed = set(LIST.read_text().splitlines())
    for name in sorted(found - listed):
        print("shown, but not in symbols.txt:", name)
    for name in sorted(listed - found):
        print("in symbols.txt, but not shown:", name)
    if found != listed:
        print("if that is meant: %s %s --update" % (sys.argv[0], library))
    return found != listed


if __name__ == "__main__":
    sys.exit(main())

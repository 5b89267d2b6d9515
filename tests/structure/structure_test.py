#!/usr/bin/env python3
"""The sources keep to the drawing in docs/architecture.md and to the limits of length; and the checks that say so work.

    tests/structure/structure_test.py [-v]
"""

import pathlib
import re
import tempfile
import unittest

import rooms
import sizes

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FOLDERS = ("librcs", "service", "shaders", "proto", "tests")
READ = (".h", ".cpp", ".py", ".proto", ".vert", ".frag", ".comp")
FUNCTIONS_IN = ("librcs/", "service/", "shaders/")

# What is known to break a rule, as "file: function has many lines": it has to, or it goes from here.
EXCEPTIONS = set()

DRAWING = """
```rooms
top
left  right
ground

right: ground  # not even what lies between
```

```headers
ground: values.h
left: left.h
top: top.h
```
"""


def faults_of_lengths():
    files = [p for folder in FOLDERS for p in sorted((ROOT / folder).rglob("*")) if p.suffix in READ]
    names = [(path, str(path.relative_to(ROOT))) for path in files]
    return [fault for path, name in names
            for fault in sizes.check_text(name, path.read_text(), name.startswith(FUNCTIONS_IN))]


def without_numbers(fault):
    """As EXCEPTIONS name it: lines come and go."""
    where, _, rest = fault.partition(": ")
    return where.split(":")[0] + ": " + re.sub(r"\d+ (lines|columns|parameters)", r"many \1", rest)


class Sources(unittest.TestCase):
    """The project's own."""

    def test_rooms_are_as_drawn(self):
        self.expect_none(rooms.check_rooms(ROOT))

    def test_public_headers_include_no_private_ones(self):
        self.expect_none(rooms.check_public_headers(ROOT))

    def test_service_sees_public_headers_alone(self):
        self.expect_none(rooms.check_service(ROOT))

    def test_nothing_is_too_long(self):
        self.expect_none(faults_of_lengths())

    def test_one_file_of_the_service_reads_clocks(self):
        clocks = re.compile(r"system_clock|CLOCK_REALTIME|gettimeofday|\b(?:std|)::time\(|high_resolution_clock")
        readers = [path.name for path in (ROOT / "service").rglob("*.cpp") if clocks.search(path.read_text())]
        self.assertEqual(readers, ["clock.cpp"])
        deadlines = [path.name for folder in ("server", "worker", "client")
                     for path in (ROOT / "service" / folder).rglob("*.cpp") if "wall_ms" in path.read_text()]
        self.assertEqual(sorted(deadlines), ["frame_logs.cpp", "log.cpp"],
                         "the wall's clock is for showing; deadlines are by the steady one")

    def test_every_exception_is_one(self):
        faults = rooms.check_rooms(ROOT) + faults_of_lengths()
        self.assertEqual(EXCEPTIONS - {without_numbers(fault) for fault in faults}, set())

    def expect_none(self, faults):
        left = [fault for fault in faults if without_numbers(fault) not in EXCEPTIONS]
        if left:
            self.fail("\n" + "\n".join(left))


class MadeUpTree(unittest.TestCase):
    """A house of four rooms, into which each test puts one fault."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("docs/architecture.md", DRAWING)
        self.write("librcs/include/rcs/values.h", "#include <vector>\n")
        self.write("librcs/include/rcs/left.h", '#include "rcs/values.h"\n')
        self.write("librcs/include/rcs/top.h", '#include "rcs/left.h"\n')
        self.write("librcs/src/ground/stone.h", '#include "rcs/values.h"\n#include "shared/weight.h"\n')
        self.write("librcs/src/left/wall.cpp", '#include "ground/stone.h"\n#include "left/wall.h"\n')
        self.write("librcs/src/right/wall.cpp", '#include "ground/stone.h"\n')
        self.write("librcs/src/top/roof.cpp", '#include "left/wall.h"\n#include "rcs/left.h"\n')
        self.write("service/main.cpp", '#include "rcs/top.h"\n#include "top/roof.h"\n')
        self.write("service/top/roof.h", "\n")

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def expect(self, faults, *words):
        self.assertEqual(len(faults), 1, faults)
        for word in words:
            self.assertIn(word, faults[0])

    def test_passes(self):
        self.assertEqual(rooms.check_rooms(self.root), [])
        self.assertEqual(rooms.check_public_headers(self.root), [])
        self.assertEqual(rooms.check_service(self.root), [])

    def test_upward_include(self):
        self.write("librcs/src/ground/stone.h", '#include "left/wall.h"\n')
        self.expect(rooms.check_rooms(self.root), "stone.h", "ground includes left/wall.h")

    def test_include_of_the_room_beside(self):
        self.write("librcs/src/left/wall.cpp", '#  include "right/wall.h"\n')
        self.expect(rooms.check_rooms(self.root), "left includes right/wall.h")

    def test_include_of_what_a_room_may_not_see(self):
        self.write("docs/architecture.md", DRAWING.replace("right: ground", "top: left"))
        self.write("librcs/src/top/roof.cpp", '#include "ground/stone.h"\n')
        self.expect(rooms.check_rooms(self.root), "top includes ground/stone.h")

    def test_public_header_of_a_higher_room(self):
        self.write("librcs/src/ground/stone.h", '#include "rcs/left.h"\n')
        self.expect(rooms.check_rooms(self.root), "ground includes rcs/left.h")

    def test_room_that_is_not_drawn(self):
        self.write("librcs/src/cellar/wine.cpp", "\n")
        self.expect(rooms.check_rooms(self.root), "no room cellar")

    def test_room_that_is_not_there(self):
        self.write("docs/architecture.md", DRAWING.replace("top\n", "top  attic\n", 1))
        self.expect(rooms.check_rooms(self.root), "no room attic")

    def test_public_header_without_a_room(self):
        self.write("librcs/include/rcs/new.h", "\n")
        self.expect(rooms.check_rooms(self.root), "new.h has no room")

    def test_private_header_in_a_public_one(self):
        self.write("librcs/include/rcs/left.h", '#include "left/wall.h"\n')
        self.expect(rooms.check_public_headers(self.root), "left.h", "private left/wall.h")

    def test_private_header_in_the_service(self):
        self.write("service/main.cpp", '#include "left/wall.h"\n')
        self.expect(rooms.check_service(self.root), "main.cpp", "private left/wall.h")


FUNCTION = """
template <typename T, int N>
class Thing : public Base<T, N> {
public:
    explicit Thing(int a, std::map<int, int> b = {{1, 2}}) : a_(a), b_{b}
    {
        for (int i = 0; i < 3; ++i) {  // }
            call("}", '}', R"(})", 1'000);
        }
    }
    bool operator()(int a) const { return a > 0; }
    void declared(int a, int b, std::function<void(int, int)> c) const;

private:
    int a_ = call(1, 2, 3);
};

constexpr auto kLambda = [](int a, int b) { return a + b; };
"""


class Lengths(unittest.TestCase):
    def test_functions_are_found(self):
        found = {name: (last - first + 1 if last else 0, parameters)
                 for name, first, last, parameters in sizes.functions(FUNCTION)}
        self.assertEqual(found, {"Thing": (6, 2), "operator()": (1, 1), "declared": (0, 3)})

    def test_long_function(self):
        body = "    call();\n" * 58
        self.assertEqual(sizes.check_text("a.cpp", "void f()\n{\n%s}\n" % body[:-12], True), [])
        self.assertEqual(sizes.check_text("a.cpp", "\nvoid f()\n{\n%s}\n" % body, True), ["a.cpp:2: f has 61 lines"])
        self.assertEqual(sizes.check_text("a.py", "def f():\n" + "    call()\n" * 60, True), ["a.py:1: f has 61 lines"])

    def test_many_parameters(self):
        eight = ", ".join("std::pair<int, int> p%d" % i for i in range(8))
        self.assertEqual(sizes.check_text("a.h", "void f(%s);\n" % eight, True)[1:], [])
        faults = sizes.check_text("a.h", "void f(\n%s,\nint i);\n" % eight.replace(", std", ",\nstd"), True)
        self.assertEqual(faults, ["a.h:1: f has 9 parameters"])

    def test_long_lines_and_files(self):
        self.assertEqual(sizes.check_text("a.proto", "//" + "é" * 118 + "\n", False), [])
        self.assertEqual(sizes.check_text("a.proto", "\n//" + "é" * 119 + "\n", False), ["a.proto:2: 121 columns"])
        self.assertEqual(sizes.check_text("a.frag", "\n" * 401, False), ["a.frag: 401 lines"])


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/env python3
"""The scripts behind ./quickstart and tests/run: what they say while they work, and what tests/run -R builds."""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
LIST = """librcs/sweep_test.cpp sweep_test
librcs/hemisphere_test.cpp hemisphere_test
librcs/render_test.cpp render_test
example.walk walk
structure
"""


def targets(*arguments):
    with tempfile.NamedTemporaryFile("w") as listed:
        listed.write(LIST)
        listed.flush()
        done = subprocess.run([sys.executable, ROOT / "tests/targets.py", listed.name, *arguments], check=True,
                              capture_output=True, text=True)
    return done.stdout.split()


def shell(script, **settings):
    return subprocess.run(["bash", "-euo", "pipefail", "-c", "source docker/setup.sh\n" + script], cwd=ROOT,
                          capture_output=True, text=True, **settings)


class Targets(unittest.TestCase):
    def test_a_name_builds_what_its_tests_need(self):
        self.assertEqual(targets("-R", "ParetoFront"), ["sweep_test"])
        self.assertEqual(targets("-RParetoFront.*Slower"), ["sweep_test"])
        self.assertEqual(targets("--tests-regex", "^example"), ["walk"])
        self.assertEqual(targets("-R", "Gradients.Agree|sweep_test"), ["hemisphere_test", "sweep_test"])

    def test_instances_are_found_by_what_tells_them_apart(self):
        self.assertEqual(targets("-R", "demo.atrium"), ["render_test"])

    def test_what_takes_no_target_builds_none(self):
        self.assertEqual(targets("-R", "^structure$"), [])

    def test_all_is_built_where_no_name_says_less(self):
        for arguments in ([], ["-LE", "slow"], ["-R", "nothing of that name"]):
            self.assertEqual(targets(*arguments), ["all"], arguments)


class Steps(unittest.TestCase):
    def test_a_step_says_how_far_it_is(self):
        said = shell("printf '[%d/20] x\\n' {1..20} | rcs_progress building").stdout
        self.assertEqual(said.split("\n")[0], "building")
        self.assertEqual([line.strip() for line in said.split("\n")[1:-1]], ["%d %%" % (10 * i + 5 * (i == 0))
                                                                           for i in range(11)])

    def test_fetching_packages_is_half_of_installing_them(self):
        said = shell("printf 'dlstatus:1:50.0:x\\nReading\\npmstatus:a:50.0:y\\n' | rcs_progress installing").stdout
        self.assertEqual(said.split(), ["installing", "25", "%", "75", "%"])

    def test_a_step_that_fails_shows_what_it_said_and_ends_the_script(self):
        with tempfile.TemporaryDirectory() as folder:
            done = shell('rcs_step trying "$LOG" bash -c "echo what went wrong; exit 3"; echo on',
                         env={"LOG": folder + "/log", "PATH": "/usr/bin:/bin"})
        self.assertEqual(done.returncode, 1)
        self.assertIn("what went wrong", done.stderr)
        self.assertNotIn("on\n", done.stdout)


class United(unittest.TestCase):
    """cmake/unite.cmake: folders, and six and more sources of one first word, are each compiled as one."""

    def test_groups_are_folders_and_first_words_wherever_the_sources_lie(self):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "c++ (two)"
            (source / "room").mkdir(parents=True)
            names = ["room/gltf_%d" % i for i in range(6)] + ["room/lamp", "room/lens_flat", "alone", "left_out"]
            for name in names:
                # What each group has of its own: of two groups of one name, or of one, the compiler would say so.
                own = {"gltf_0": "int own = 1;", "lamp": "int own = 2;"}.get(pathlib.Path(name).name, "")
                (source / (name + ".cpp")).write_text("namespace { %s }\n" % own)
            (source / "CMakeLists.txt").write_text(
                "cmake_minimum_required(VERSION 3.25)\nproject(x CXX)\ninclude(%s)\n" % (ROOT / "cmake/unite.cmake")
                + "add_library(x STATIC %s)\n" % " ".join(
                    "${CMAKE_CURRENT_SOURCE_DIR}/%s.cpp" % name for name in names)
                + "rcs_unite(x EXCEPT ${CMAKE_CURRENT_SOURCE_DIR}/left_out.cpp)\n")
            for command in (["-G", "Ninja", "-S", source, "-B", source / "build", "-D", "RCS_UNITE=ON"],
                            ["--build", source / "build"]):
                done = subprocess.run(["cmake", *command], capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            united = sorted(len(re.findall(r"#include", file.read_text()))
                            for file in (source / "build").rglob("unity_*.cxx"))
            self.assertEqual(united, [1, 2, 6])


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/env python3
"""The scripts behind ./quickstart and tests/run: what they say while they work, and what tests/run -R builds."""

import pathlib
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


if __name__ == "__main__":
    unittest.main()

import pathlib
import unittest

import tables
from job import Run
from processes import Cost


def run(renderer, cpu, wall, mre):
    return Run(renderer, "-x", 2, Cost(wall, cpu), pathlib.Path("none.exr"), mre)


class EqualTable(unittest.TestCase):
    SPLAT = [run("rcsplat render", 2.0, 1.0, 0.2), run("rcsplat render", 8.0, 4.0, 0.1)]

    def rows(self, caches, paths):
        return tables.equal_table(self.SPLAT, caches, paths, [0.1]).splitlines()[2:]

    def test_states_how_many_times_more_a_peer_took(self):
        row = self.rows([run("rpict", 60.0, 60.0, 0.2)], [])[0]
        self.assertEqual(row, "| 20.0 % | rpict `-x` | 60.0 | 60.0 | 2.0 | 1.0 | 30.0 x | 60.0 x |")

    def test_leaves_the_ratio_empty_where_no_setting_is_that_good(self):
        row = self.rows([run("rpict", 60.0, 60.0, 0.05)], [])[0]
        self.assertEqual(row, "| 5.0 % | rpict `-x` | 60.0 | 60.0 | not reached | not reached |  |  |")

    def test_marks_an_extrapolated_path_tracer(self):
        row = self.rows([], [run("paths", 10.0, 5.0, 0.2)])[0]
        self.assertEqual(row, "| 10.0 % | paths | 40.0 ^ | 20.0 ^ | 8.0 | 4.0 | 5.0 x | 5.0 x |")


if __name__ == "__main__":
    unittest.main()

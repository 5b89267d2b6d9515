import unittest

import equal_error


class Front(unittest.TestCase):
    def test_leaves_out_what_is_both_dearer_and_worse(self):
        self.assertEqual(equal_error.front([(0.1, 8.0), (0.4, 1.0), (0.2, 9.0), (0.3, 1.0)]), [(0.1, 8.0), (0.3, 1.0)])


class CostAt(unittest.TestCase):
    POINTS = [(0.4, 1.0), (0.1, 16.0)]  # cost falls with the square of the error

    def test_follows_the_power_law_between_two_runs(self):
        at = equal_error.cost_at(0.2, self.POINTS)
        self.assertAlmostEqual(at.cost, 4.0)
        self.assertEqual(at.kind, "interpolated")

    def test_is_a_run_s_own_cost_at_its_error(self):
        at = equal_error.cost_at(0.1, self.POINTS)
        self.assertEqual((at.cost, at.kind), (16.0, "measured"))

    def test_beyond_the_coarsest_run_is_that_run_s(self):
        at = equal_error.cost_at(0.9, self.POINTS)
        self.assertEqual((at.cost, at.kind), (1.0, "measured"))

    def test_of_an_error_no_run_reached_is_none(self):
        self.assertIsNone(equal_error.cost_at(0.05, self.POINTS))
        self.assertIsNone(equal_error.cost_at(0.05, []))

    def test_of_more_paths_is_extrapolated_by_the_square_root_law(self):
        at = equal_error.path_cost_at(0.05, self.POINTS)
        self.assertAlmostEqual(at.cost, 64.0)
        self.assertEqual(at.kind, "extrapolated")
        self.assertEqual(equal_error.path_cost_at(0.2, self.POINTS).kind, "interpolated")


if __name__ == "__main__":
    unittest.main()

import pathlib
import sys
import tempfile
import unittest

import processes


class Timed(unittest.TestCase):
    def test_counts_processor_time_of_the_child_only(self):
        busy = "import time\nwhile time.process_time() < 0.2: pass"
        cost = processes.timed([sys.executable, "-c", busy])
        self.assertGreaterEqual(cost.cpu, 0.2)
        idle = processes.timed([sys.executable, "-c", "import time; time.sleep(0.2)"])
        self.assertGreaterEqual(idle.wall, 0.2)
        self.assertLess(idle.cpu, idle.wall)

    def test_counts_grandchildren(self):
        inner = "import time\nwhile time.process_time() < 0.2: pass"
        cost = processes.timed([sys.executable, "-c",
                                f"import subprocess, sys; subprocess.run([sys.executable, '-c', {inner!r}])"])
        self.assertGreaterEqual(cost.cpu, 0.2)

    def test_passes_standard_input_and_output_by_path(self):
        with tempfile.TemporaryDirectory() as folder:
            source, sink = pathlib.Path(folder, "in"), pathlib.Path(folder, "out")
            source.write_bytes(b"light")
            processes.timed([sys.executable, "-c", "import sys; print(sys.stdin.read().upper(), end='')"], source, sink)
            self.assertEqual(sink.read_bytes(), b"LIGHT")

    def test_ends_the_program_with_what_a_failing_child_said(self):
        with tempfile.TemporaryDirectory() as folder, self.assertRaises(SystemExit) as end:
            processes.timed([sys.executable, "-c", "import sys; sys.exit('no such scene')"],
                            log=pathlib.Path(folder, "log"))
        self.assertIn("failed with 1: no such scene", str(end.exception))


if __name__ == "__main__":
    unittest.main()

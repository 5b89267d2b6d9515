import pathlib
import shutil
import subprocess
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    raise unittest.SkipTest("needs numpy")

import images


@unittest.skipUnless(shutil.which("oiiotool"), "needs oiiotool")
class Layers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def pixel(self, path, x, y):
        """Values there, by the names of their channels."""
        text = subprocess.run(["oiiotool", "-v", "--info", "--dumpdata", path], check=True, text=True,
                              stdout=subprocess.PIPE).stdout.splitlines()
        names = next(line for line in text if "channel list:" in line).split(":", 1)[1].split(",")
        values = next(line for line in text if f"Pixel ({x}, {y})" in line).split(":", 1)[1].split()
        return {name.strip(): float(value) for name, value in zip(names, values)}

    def test_indirect_light_keeps_rows_from_the_top_and_floats(self):
        pixels = np.zeros((2, 3, 3), np.float32)
        pixels[0, 2] = [1.5, 1e-6, 70000.0]
        images.write_indirect(self.folder / "i.exr", pixels)
        found = self.pixel(self.folder / "i.exr", 2, 0)
        self.assertEqual(set(found), {"indirect.R", "indirect.G", "indirect.B"})
        self.assertAlmostEqual(found["indirect.G"], 1e-6, places=9)
        self.assertEqual((found["indirect.R"], found["indirect.B"]), (1.5, 70000.0))
        self.assertEqual(self.pixel(self.folder / "i.exr", 2, 1)["indirect.R"], 0.0)

    def test_difference_is_what_the_picture_has_more(self):
        for name, values in (("full", [3, 2, 1]), ("direct", [1, 1, 1])):
            subprocess.run(["oiiotool", "--pattern", f"constant:color={','.join(map(str, values))}", "4x4", "3", "-d",
                            "float", "-o",
                            self.folder / f"{name}.exr"], check=True)
        images.write_difference(self.folder / "i.exr", self.folder / "full.exr", self.folder / "direct.exr")
        self.assertEqual(self.pixel(self.folder / "i.exr", 0, 0),
                         {"indirect.R": 2.0, "indirect.G": 1.0, "indirect.B": 0.0})


if __name__ == "__main__":
    unittest.main()

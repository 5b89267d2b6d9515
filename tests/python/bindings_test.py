#!/usr/bin/env python3
"""librcs in Python does what the program does. usage: bindings_test.py FOLDER_WITH_rcs RCSPLAT

Skipped (exit code 77) where the bindings were not built or numpy is missing.
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import unittest

SKIPPED = 77
sys.path.insert(0, sys.argv[1])
try:
    import numpy as np
    import rcs
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(SKIPPED)

RCSPLAT = sys.argv[2]
SMALL = dict(width=48, height=32, aa=1, rays=32, error_tolerance=0.4)


class Bindings(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.session = rcs.Session(threads=2)
        cls.session.show(rcs.load_scene("demo:cornell"))

    def test_a_render_has_the_pixels_of_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            file = f"{folder}/a.exr"
            subprocess.run([RCSPLAT, "render", "demo:cornell", "--size", "48x32", "--aa", "1", "--rays", "32",
                            "--accuracy", "0.4", "--pixel-format", "float", "-q", "-o", file], check=True)
            theirs = rcs.read(file)
        ours = rcs.render(self.session, **SMALL).picture
        for layer in ["beauty", "indirect", "normal", "depth"]:
            np.testing.assert_array_equal(ours[layer], theirs[layer], err_msg=layer)

    def test_layers_look_at_memory_that_lives_as_long_as_they_do(self):
        picture = rcs.render(self.session, **SMALL).picture
        layer = picture["beauty"]
        self.assertFalse(layer.flags.owndata)
        self.assertFalse(layer.flags.writeable)
        self.assertEqual((layer.shape, layer.dtype), ((32, 48, 4), np.float32))
        self.assertEqual(layer.__array_interface__["data"], picture["beauty"].__array_interface__["data"])
        before = layer.copy()
        del picture
        rcs.render(self.session, **SMALL)
        np.testing.assert_array_equal(layer, before)

    def test_records_and_splats_by_hand(self):
        gbuffer = rcs.render_gbuffer(self.session, width=48, height=32)
        pixels = np.flatnonzero(gbuffer.covered)[::16]
        records = rcs.gather_records(self.session, gbuffer, pixels, rays=64)
        self.assertEqual(len(records), len(pixels))
        np.testing.assert_allclose(np.linalg.norm(records.normal, axis=1), 1.0, atol=1e-5)
        self.assertTrue((records.irradiance >= 0.0).all())
        splats = rcs.splat(self.session, records, gbuffer, overlap=6.0)
        reached = splats.weight > 0.0
        np.testing.assert_allclose(splats.irradiance()[..., 0][reached], (splats.weighted_r / np.where(
            reached, splats.weight, 1.0))[reached], rtol=1e-5)
        placed = rcs.place_records(self.session, gbuffer, rays=32)
        covered = rcs.splat(self.session, placed, gbuffer).count[gbuffer.covered]
        self.assertTrue((covered > 0).all(), "place_records() leaves no hole")

    def test_compare_takes_pictures_and_arrays(self):
        picture = rcs.render(self.session, **SMALL).picture
        self.assertEqual(rcs.compare(picture, picture, layer="indirect")["mean_relative_error"], 0.0)
        twice = rcs.compare(2.0 * picture["beauty"], picture["beauty"])
        self.assertAlmostEqual(twice["ratio_of_means"], 2.0, places=5)
        reference = rcs.render_reference(self.session, width=48, height=32, samples=64)
        self.assertLess(rcs.compare(picture, reference, layer="indirect")["mean_relative_error"], 0.5)

    def test_references_have_windows_lenses_and_moments(self):
        def reference(samples=64, **more):
            return rcs.render_reference(self.session, width=24, height=16, samples=samples, **more)
        whole = reference()["beauty"]
        np.testing.assert_array_equal(reference(crop=(4, 2, 8, 6))["beauty"], whole[2:8, 4:12])
        blurred = reference(aa=64, f_stop=0.1, focus=0.5)["beauty"]
        self.assertGreater(np.abs(blurred - reference(aa=64)["beauty"]).max(), 0.05)

        def walk(part):
            return rcs.Camera.look_at((2 * part - 1, 1, 3), (0, 1, 0))
        truth = reference(samples=1024, aa=64, moments=walk)
        moved = rcs.compare(rcs.render(self.session, moments=walk, width=24, height=16, aa=64).picture, truth,
                            layer="direct")
        still = rcs.compare(rcs.render(self.session, walk(0.5), width=24, height=16, aa=64).picture, truth,
                            layer="direct")
        self.assertLess(2 * moved["mean_relative_error"], still["mean_relative_error"])

        def broken(part):
            raise ZeroDivisionError(part)
        with self.assertRaises(ZeroDivisionError):
            reference(moments=broken)
        with self.assertRaisesRegex(rcs.Error, "crop is 20,0,8,8"):
            reference(crop=(20, 0, 8, 8))
        with self.assertRaisesRegex(rcs.Error, "expected a camera, or a scene and a camera"):
            reference(moments=lambda part: (1, 2, 3))

    def test_errors_have_the_code_of_the_library(self):
        def code(call, *arguments, **named):
            with self.assertRaises(rcs.Error) as raised:
                call(*arguments, **named)
            return raised.exception.code, str(raised.exception)
        self.assertEqual(code(rcs.load_scene, "nowhere.glb")[0], "not_found")
        self.assertEqual(code(rcs.render, self.session, "none")[0], "not_found")
        self.assertEqual(code(rcs.render, self.session, aa=0),
                         ("bad_argument", "aa is 0, expected a whole number in [1, 256]"))
        self.assertIn("did you mean 'width'?", code(rcs.render, self.session, widht=4)[1])
        self.assertEqual(code(rcs.render, self.session, rays=64, target_error=0.1)[0], "bad_argument")
        self.assertEqual(code(rcs.gather_records, self.session, rcs.render_gbuffer(self.session, None, 8, 8), [-1])[0],
                         "bad_argument")
        with self.assertRaises(KeyError):
            rcs.render(self.session, **SMALL).picture["none"]

    def test_what_a_callback_raises_stops_the_render(self):
        def stop(stage, fraction):
            raise KeyError(stage)
        with self.assertRaises(KeyError):
            rcs.render(self.session, progress=stop, **SMALL)
        self.assertEqual(rcs.render(self.session, **SMALL).picture["beauty"].shape, (32, 48, 4))

    def test_other_threads_run_while_it_renders(self):
        ran = threading.Event()
        asked = threading.Event()

        def other():
            asked.wait()
            ran.set()
        thread = threading.Thread(target=other)
        thread.start()
        seen = []
        rcs.render(self.session, progress=lambda stage, fraction: (asked.set(), seen.append(ran.wait(60))), **SMALL)
        thread.join()
        self.assertTrue(all(seen) and seen)

    def test_the_stub_names_what_the_module_has(self):
        stub = (pathlib.Path(rcs.__file__).parent / "__init__.pyi").read_text()
        for name in rcs.__all__:
            self.assertRegex(stub, rf"(?m)^(class|def) {name}\b|^{name}:")
            for member in vars(getattr(rcs, name)) if isinstance(getattr(rcs, name), type) else []:
                if not member.startswith("_"):
                    self.assertRegex(stub, rf"(?m)^    (def )?{member}\b", f"{name}.{member}")

    def test_the_example_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            example = pathlib.Path(__file__).parents[2] / "librcs/examples/by_hand.py"
            subprocess.run([sys.executable, example, folder], check=True,
                           env={**os.environ, "PYTHONPATH": sys.argv[1], "HOME": folder})
            self.assertEqual(sorted(p.name for p in pathlib.Path(folder).iterdir() if p.is_file()),
                             ["cornell.png", "irradiance.exr"])


unittest.main(argv=sys.argv[:1])

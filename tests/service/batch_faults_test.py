#!/usr/bin/env python3
"""What `rcsplat batch` does when the disk is full, its folder cannot be written to, its scene is replaced meanwhile, or
a frame kills the process: clear words and exit codes, the other frames done, and the same command goes on.

usage: batch_faults_test.py RCSPLAT
"""
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

RCSPLAT = ""
PATIENCE = 60  # [s]
NOBODY = 65534
TRIANGLE = {
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0],
                   "max": [1, 1, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,"
                                          "AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAAAAAAAAgD8AAAAA"}]}
# Frame 2 looks away from the room: its file is small.
PATH = {"fps": 1, "keys": [{"frame": 1, "eye": [0, 1, 3], "target": [0, 1, 0]},
                           {"frame": 2, "eye": [0, 1, 9], "target": [0, 1, 99], "cut": True},
                           {"frame": 3, "eye": [0, 1, 3.2], "target": [0, 1, 0], "cut": True},
                           {"frame": 4, "eye": [0, 1, 3.4], "target": [0, 1, 0]}]}


def wait_for(path, process=None):
    end = time.monotonic() + PATIENCE
    while not path.exists():
        if time.monotonic() > end or (process and process.poll() is not None):
            raise AssertionError(f"{path} does not come")
        time.sleep(0.001)


class Faults(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="rcs-faults-"))
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "out").mkdir()

    def words(self, scene, frames, size="16x16", ending="png", more=()):
        output = self.folder / f"out/f.####.{ending}"
        return [str(word) for word in [RCSPLAT, "batch", scene, "--frames", frames, "--fps", "1", "--size", size,
                                       "--aa", "1", "--rays", "16", "--no-movie", "-o", output, *more]]

    def run_batch(self, words, **how):
        return subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False, **how)

    def counts(self):
        return json.loads((self.folder / "out/report.json").read_text())["counts"]

    def errors(self):
        frames = json.loads((self.folder / "out/report.json").read_text())["frames"]
        return {frame["frame"]: frame.get("error", "") for frame in frames}

    def expect_no_parts(self):
        names = [path.name for path in self.folder.rglob("*") if ".tmp-" in path.name]
        self.assertEqual(names, [], "nothing half written stays")

    def test_a_disk_without_room(self):
        (self.folder / "path.json").write_text(json.dumps(PATH))
        words = self.words("demo:cornell", "1-4", "96x96", "exr", ["--camera-path", self.folder / "path.json"])

        def little_room():  # for each file; what is written beyond fails as on a full disk
            resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
        done = self.run_batch(words, preexec_fn=little_room)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual((self.counts()["rendered"], self.counts()["failed"]), (1, 3), done.stdout)
        self.assertTrue((self.folder / "out/f.0002.exr").exists())
        self.assertRegex(self.errors()[1], "cannot write.*f.0001.exr.*File too large")
        self.assertIn("1 of 4 frames are there, 3 failed", done.stderr)
        self.expect_no_parts()
        self.assertEqual(self.run_batch(words).returncode, 0)
        self.assertEqual((self.counts()["rendered"], self.counts()["kept"]), (3, 1))

    def as_nobody(self):
        if os.geteuid() == 0:
            os.setgroups([])
            os.setgid(NOBODY)
            os.setuid(NOBODY)

    def test_a_folder_that_cannot_be_written_to(self):
        self.folder.chmod(0o755)
        if subprocess.run(["test", "-x", RCSPLAT], preexec_fn=self.as_nobody, check=False).returncode != 0:
            self.skipTest("a user without rights cannot run it here")
        out = self.folder / "out"
        out.chmod(0o555)
        words = self.words("demo:furnace", "1-400")
        how = {"preexec_fn": self.as_nobody, "cwd": "/"}
        done = self.run_batch(words, **how)
        self.assertEqual(done.returncode, 73, done.stderr)
        self.assertRegex(done.stderr, "out.*Permission denied")
        self.assertEqual(list(out.iterdir()), [])

        out.chmod(0o777)
        with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **how) as batch:
            wait_for(out / "f.0003.png", batch)
            out.chmod(0o555)
            said = batch.communicate(timeout=PATIENCE)[1]
        self.assertEqual(batch.returncode, 73, said)
        self.assertRegex(said, "cannot write.*Permission denied")
        done_before = len(list(out.glob("f.*.png")))
        self.assertGreaterEqual(done_before, 3)
        self.assertLess(done_before, 400)
        self.expect_no_parts()
        out.chmod(0o777)
        self.assertEqual(self.run_batch(words, **how).returncode, 0)
        self.assertGreaterEqual(self.counts()["kept"], 2)
        self.assertEqual(self.counts()["kept"] + self.counts()["rendered"], 400)

    def test_a_scene_that_is_replaced(self):
        scene = self.folder / "scene.gltf"
        scene.write_text(json.dumps(TRIANGLE))
        words = self.words(scene, "1-400")
        with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as batch:
            wait_for(self.folder / "out/f.0003.png", batch)
            other = dict(TRIANGLE, nodes=[{"mesh": 0, "translation": [0.5, 0, 0]}])
            (self.folder / "new.gltf").write_text(json.dumps(other))
            (self.folder / "new.gltf").replace(scene)
            said = batch.communicate(timeout=PATIENCE)[1]
        self.assertEqual(batch.returncode, 1, said)
        shown = self.counts()["rendered"]
        self.assertTrue(3 <= shown < 400, shown)
        self.assertEqual(self.counts()["failed"], 400 - shown)
        self.assertIn("has changed while its frames were rendered", self.errors()[400])
        last = self.run_batch(words)
        self.assertIn(last.returncode, (0, 80), last.stderr)
        self.assertEqual(self.counts()["rendered"], 400, "all show the new one")

    def test_a_frame_that_kills_its_process(self):
        words = self.words("demo:atrium", "1-3", "400x300")
        mark = self.folder / "out/.rcsplat/f.0001.png.json.running"
        for start in (1, 2):  # as if it were the first frame's doing
            with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as batch:
                wait_for(mark, batch)
                while mark.read_text().strip() != str(start):
                    self.assertIsNone(batch.poll())
                batch.send_signal(signal.SIGKILL)
        last = self.run_batch([word if word != "400x300" else "16x16" for word in words])
        self.assertIn(last.returncode, (0, 80), last.stderr)
        order = [line.split(":")[0] for line in last.stdout.splitlines() if line.startswith("frame ")]
        self.assertEqual(order, ["frame 2", "frame 3", "frame 1"], "the others come before it")
        self.assertFalse(mark.exists())
        self.expect_no_parts()


if __name__ == "__main__":
    RCSPLAT = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()

#!/usr/bin/env python3
"""Kills batches at random moments and goes on with them, until all is there.

    tests/service/drills/batch_kills.py build/release/bin/rcsplat [--rounds 100] [--seed 1]

A round takes a batch of demo:atrium's animation (moving camera, thing and door, a lamp that goes on) as one command or
in parts, with or without reuse between frames, kills it (SIGKILL) one to four times, and lets it end. What must hold:
exit code 0, all frames and no other file, frames that were done before a kill have the same file with the same
contents after it. Independent frames have the bits of a batch that nobody killed, and of `rcsplat render`. Frames that
reuse what there was when they were made are off by no more than their own estimates explain.
"""

import argparse
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import time

FPS = 24
FRAMES = range(1, 25)
LOOK = ["demo:atrium", "--camera", "walk", "--size", "64x36", "--aa", "1"]
ENDINGS = ("exr", "png")
INTERRUPTED = -9
# Two pictures, each as wrong as it says, differ by at most so many times their errors' root of squares.
MOST_APART = 1.5


def batch(rcsplat, folder, frames, is_independent, exposure="auto"):
    return [str(rcsplat), "batch", *LOOK, "--fps", str(FPS), "--exposure", exposure, "--no-movie",
            "--frames", "%d-%d" % (frames[0], frames[-1]), *(["--independent-frames"] if is_independent else []),
            *(word for ending in ENDINGS for word in ("-o", str(folder / ("f.####." + ending))))]


def paths(folder):
    return {"f.%04d.%s" % (n, ending): folder / ("f.%04d.%s" % (n, ending)) for n in FRAMES for ending in ENDINGS}


def states(folder):
    """Of the frames that are done (files and what is known of them): contents, and which file it is."""
    found = {}
    for n in FRAMES:
        files = [folder / ("f.%04d.%s" % (n, ending)) for ending in ENDINGS]
        if all(f.exists() for f in files) and (folder / ".rcsplat" / (files[0].name + ".json")).exists():
            found.update({f.name: (f.read_bytes(), f.stat().st_ino, f.stat().st_mtime_ns) for f in files})
    return found


def error_between(rcsplat, a, b):
    said = subprocess.run([rcsplat, "compare", a, b, "--json"], check=True, capture_output=True, text=True).stdout
    return json.loads(said)["mean_relative_error"]


def told_errors(folder):
    report = json.loads((folder / "report.json").read_text())
    return {f["frame"]: f["figures"]["error"] for f in report["frames"]}


class Drill:
    def __init__(self, rcsplat, scratch, seed):
        self.rcsplat, self.scratch, self.random = rcsplat, scratch, random.Random(seed)
        self.kills = self.kept = 0
        self.whole, self.seconds = {}, {}
        for is_independent in (True, False):
            folder = scratch / ("whole%d" % is_independent)
            began = time.monotonic()
            subprocess.run(batch(rcsplat, folder, FRAMES, is_independent), check=True, capture_output=True)
            self.seconds[is_independent] = time.monotonic() - began
            self.whole[is_independent] = folder
        self.check_renders()

    def check_renders(self):
        for n in (FRAMES[0], FRAMES[len(FRAMES) // 2]):
            alone = self.scratch / "alone.exr"
            subprocess.run([self.rcsplat, "render", *LOOK, "--time", repr(n / FPS), "-o", alone], check=True,
                           capture_output=True)
            apart = error_between(self.rcsplat, self.whole[True] / ("f.%04d.exr" % n), alone)
            assert apart == 0.0, "frame %d of independent frames is not what render makes: %g" % (n, apart)

    def run_killed(self, words, folder, seconds):
        """Kills it after a while, unless it ended before."""
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
        _, said = process.communicate()
        assert process.returncode in (0, INTERRUPTED), "%s ended with %d: %s" % (words, process.returncode, said)
        self.kills += process.returncode == INTERRUPTED
        return states(folder)

    def end(self, words):
        done = subprocess.run(words, capture_output=True, text=True)
        assert done.returncode == 0, "%s ended with %d: %s" % (words, done.returncode, done.stderr)

    def round(self, k):
        is_independent, parts = k % 2 == 0, 1 if k % 4 < 2 else self.random.randint(2, 5)
        folder = self.scratch / ("round%d" % k)
        length = math.ceil(len(FRAMES) / parts)
        # Parts of a batch that share records find an exposure each, and the whole renders again what has another.
        exposure = "auto" if is_independent or parts == 1 else "1"
        before = {}
        for first in range(0, len(FRAMES), length):
            words = batch(self.rcsplat, folder, FRAMES[first:first + length], is_independent, exposure)
            for _ in range(self.random.randint(1, 4)):
                after = self.run_killed(words, folder, self.random.random() * self.seconds[is_independent] / parts)
                self.same(before, after)
                before = after
            self.end(words)
        self.end(batch(self.rcsplat, folder, FRAMES, is_independent, exposure))
        after = states(folder)
        self.same(before, after)
        self.check(folder, after, is_independent)

    def same(self, before, after):
        for name, state in before.items():
            assert after.get(name) == state, "%s was done, and is another file now" % name
        self.kept += len(before)

    def check(self, folder, after, is_independent):
        wanted = set(paths(folder))
        assert set(after) == wanted, "missing: %s" % sorted(wanted - set(after))
        found = {p.name for p in folder.iterdir()}
        extra = found - wanted - {".rcsplat", "report.html", "report.json"}
        assert not extra, "left behind: %s" % sorted(extra)
        known = {p.name for p in (folder / ".rcsplat").iterdir()}
        assert len(known) == len(FRAMES), "left behind: %s" % sorted(known)
        whole = self.whole[is_independent]
        if is_independent:
            for name, (contents, _, _) in after.items():
                assert contents == (whole / name).read_bytes(), "%s has other bits" % name
            return
        own, others = told_errors(folder), told_errors(whole)
        for n in FRAMES:
            apart = error_between(self.rcsplat, folder / ("f.%04d.exr" % n), whole / ("f.%04d.exr" % n))
            most = MOST_APART * math.hypot(own[n], others[n])
            assert apart <= most, "frame %d is %g off, of %g that the errors explain" % (n, apart, most)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat", type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        drill = Drill(arguments.rcsplat.resolve(), pathlib.Path(scratch), arguments.seed)
        for k in range(arguments.rounds):
            try:
                drill.round(k)
            except AssertionError as wrong:
                print("round %d: %s" % (k, wrong))
                sys.exit(1)
        print("%d rounds of %d frames, %d killed; %d times a file was there before a kill and the same after it" %
              (arguments.rounds, len(FRAMES), drill.kills, drill.kept))


if __name__ == "__main__":
    main()

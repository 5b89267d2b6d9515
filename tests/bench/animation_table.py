#!/usr/bin/env python3
"""Renders animations as batches, as independent frames and by single renders, and prints as Markdown what that costs,
what the frames are off by and how calm they are.

    tests/bench/animation_table.py build/release/bin/rcsplat ../shared/scenes -o /tmp/animations > table.md

Cost is the processor time of the batch over that of one `rcsplat render` for each of its frames, processes with all
that they do; --every N times every N-th of the latter alone and takes the rest for alike. Errors are those of
indirect light against `rcsplat reference` at every third pixel of every third row, by so many paths a case (or --spp)
that its noise is about a third of what is measured; that noise is not taken off, and told beside. Batches and frames
by themselves are judged with --seeds seeds each, in the mean, as one alone may be well or ill off by a tenth. The worst
frame is the one whose error is largest over that of the same frame by itself. Then the frames' own estimates.
Flicker is `rcsplat flicker` of the layer irradiance, points followed by the layer motion, in the median: over the
frames in which no light changes by much, the worst of several parts. Errors and flicker are told at --aa 1.
References are kept in the output folder.
"""
import argparse
import json
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys

FPS = 24
LAYERS = "indirect,irradiance,depth,normal,motion"
WALK = {"fps": FPS, "keys": [{"frame": 1, "eye": [-9, 3, -0.9], "target": [0, 2.6, 0], "fov": 60},
                             {"frame": 48, "eye": [-7, 2.6, -0.5], "target": [1, 2.6, 0], "fov": 60}]}
CASES = [
    # name, scene, camera, what part of single renders' time is wanted at --aa 1 and 4, paths of references,
    # parts in which light is steady
    ("static scene, moving camera", "sponza.glb", ["--camera-path", "walk.json"],
     {1: 0.20, 4: 0.40}, 12032, [(1, 48)]),
    ("things, a lamp and the camera move", "demo:atrium", ["--camera", "walk"],
     {1: 0.30, 4: 0.50}, 9600, [(1, 11), (42, 48)]),
    ("all is skinned or moves", "cornell-animated.glb", [], {1: 1.05, 4: 1.05}, 24064, []),
]


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat", type=pathlib.Path)
    parser.add_argument("scenes", type=pathlib.Path, help="folder; scenes that are not there are left out")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--spp", type=int, help="paths of references; default: what each case takes")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=5, help="of batches and of frames by themselves, for errors")
    parser.add_argument("--aa", type=int, nargs="+", default=[1, 4])
    parser.add_argument("--case", help="part of a case's name or scene: the others are left out")
    return parser.parse_args()


class Runner:
    def __init__(self, arguments):
        self.arguments = arguments

    def run(self, *words):
        """Returns what it printed, and its processor time [s]."""
        def spent():
            usage = resource.getrusage(resource.RUSAGE_CHILDREN)
            return usage.ru_utime + usage.ru_stime
        before = spent()
        done = subprocess.run([str(self.arguments.rcsplat), *map(str, words)], capture_output=True, text=True)
        if done.returncode not in (0, 80):
            sys.exit(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stderr}")
        return done.stdout, spent() - before

    def batch(self, scene, camera, aa, folder, *more):
        shutil.rmtree(folder, ignore_errors=True)
        _, seconds = self.run("batch", scene, *camera, "--frames", f"1-{self.arguments.frames}", "--fps", FPS, "--size",
                              self.arguments.size, "--aa", aa, "--layers", LAYERS, "--motion-time", repr(-1 / FPS),
                              "--no-movie", "-o", folder / "f.####.exr", *more)
        return seconds

    def single(self, scene, camera, aa, frame, file, *more):
        """The same layers as a batch writes, so that both write as much."""
        file.parent.mkdir(parents=True, exist_ok=True)
        _, seconds = self.run("render", scene, *camera, "--time", repr(frame / FPS), "--size", self.arguments.size,
                              "--aa", aa, "--layers", LAYERS, "--motion-time", repr((frame - 1) / FPS), "-o", file,
                              *more)
        return seconds

    def singles(self, scene, camera, aa, folder):
        file = folder / "single.exr"
        some = range(1, self.arguments.frames + 1, self.arguments.every)
        return statistics.mean(self.single(scene, camera, aa, n, file) for n in some) * self.arguments.frames

    def reference(self, scene, camera, paths, frame, folder):
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"r.{self.arguments.size}.{paths}.{frame:04}.exr"
        if not file.exists():
            self.run("reference", scene, *camera, "--time", repr(frame / FPS), "--size", self.arguments.size, "--spp",
                     paths, "--stride", 3, "-o", file)
        return file

    def errors(self, pictures, references):
        """Errors of frames; means over them of the ratio of means and of the references' noise."""
        found = [json.loads(self.run("compare", pictures / f"f.{n:04}.exr", r, "--layer", "indirect", "--json")[0])
                 for n, r in references.items()]
        return [[f["mean_relative_error"] for f in found],
                *(statistics.mean(f[name] for f in found) for name in ("ratio_of_means", "reference_noise"))]

    def flicker(self, pictures, first, last):
        files = [pictures / f"f.{n:04}.exr" for n in range(first, last + 1)]
        return json.loads(self.run("flicker", *files, "--layer", "irradiance", "--json")[0])["median"]

    def estimate(self, pictures, frames):
        told = {f["frame"]: f["figures"]["indirect_error"]
                for f in json.loads((pictures / "report.json").read_text())["frames"]}
        return statistics.mean(told[n] for n in frames)


def mean_of_seeds(found):
    """@param found  Runner.errors() of each seed"""
    errors, ratios, noises = zip(*found)
    return [statistics.mean(of_frame) for of_frame in zip(*errors)], statistics.mean(ratios), statistics.mean(noises)


def row(runner, case, scene, camera, aa, folder):
    name, file, _, wanted, paths, steady = case
    wanted, paths = wanted[aa], runner.arguments.spp or paths
    pictures, alone = folder / f"batch{aa}", folder / f"alone{aa}"
    seconds = runner.batch(scene, camera, aa, pictures)
    by_itself = runner.singles(scene, camera, aa, folder)
    cells = [f"{file}: {name}", f"`--aa {aa}`", f"{seconds:.0f} of {by_itself:.0f} s",
             f"{100 * seconds / by_itself:.0f} % ({100 * wanted:.0f})"]
    if aa > 1:
        return "| " + " | ".join(cells + [""] * 9) + " |"
    runner.batch(scene, camera, aa, alone, "--independent-frames")
    judged = range(6, runner.arguments.frames + 1, 6)
    references = {n: runner.reference(scene, camera, paths, n, folder / "references") for n in judged}
    of_batch, by_themselves = [runner.errors(pictures, references)], [runner.errors(alone, references)]
    told = [runner.estimate(pictures, judged)]
    others = folder / "seeds"
    for seed in range(2, runner.arguments.seeds + 1):
        runner.batch(scene, camera, aa, others, "--seed", seed)
        of_batch.append(runner.errors(others, references))
        told.append(runner.estimate(others, judged))
        for n in references:
            runner.single(scene, camera, aa, n, others / f"f.{n:04}.exr", "--seed", seed)
        by_themselves.append(runner.errors(others, references))
    errors, ratio, noise = mean_of_seeds(of_batch)
    their_errors, their_ratio, _ = mean_of_seeds(by_themselves)
    mine, theirs, told = statistics.mean(errors), statistics.mean(their_errors), statistics.mean(told)
    worst, its_number = max((a / b, n) for a, b, n in zip(errors, their_errors, judged))
    cells += [f"{100 * mine:.1f} of {100 * theirs:.1f} %", f"{worst:.2f} times ({its_number})", f"{100 * noise:.1f} %",
              f"{100 * (ratio - 1):+.1f}, {100 * (their_ratio - 1):+.1f} %", f"{100 * told:.1f} %",
              f"{told / mine:.2f}"]
    parts = [(first, last) for first, last in steady if last <= runner.arguments.frames]
    if parts:
        calm, restless = max((runner.flicker(pictures, *part), runner.flicker(alone, *part)) for part in parts)
        cells += [f"{100 * calm:.2f} %", f"{100 * restless:.2f} %", f"{calm / restless:.2f}"]
    else:
        cells += [""] * 3
    return "| " + " | ".join(cells) + " |"


def main():
    arguments = parse()
    arguments.output.mkdir(parents=True, exist_ok=True)
    walk = arguments.output / "walk.json"
    walk.write_text(json.dumps(WALK))
    runner = Runner(arguments)
    print("| | | processor time, batch of single renders | part (wanted) | MRE of every sixth frame, of independent "
          "frames | worst frame | noise in it | bias | estimated | of the MRE | flicker "
          "| of independent frames | ratio |")
    print("|" + " --- |" * 13)
    for number, case in enumerate(CASES):
        name, file, camera, wanted, *_ = case
        scene = file if file.startswith("demo:") else arguments.scenes / file
        if arguments.case and arguments.case not in name + file:
            continue
        if not file.startswith("demo:") and not scene.exists():
            print(f"{scene} is missing: left out", file=sys.stderr)
            continue
        camera = [str(walk) if word == "walk.json" else word for word in camera]
        for aa in arguments.aa:
            if aa in wanted:
                print(row(runner, case, scene, camera, aa, arguments.output / f"case{number}"), flush=True)


if __name__ == "__main__":
    main()

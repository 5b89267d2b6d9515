#!/usr/bin/env python3
"""Does a picture know its error? Renders seven views at several settings, and compares what each picture estimates with
what two references of different seeds measure. Prints the table as Markdown. References are kept in the output folder
and made only when missing.

MRE is the mean of |I - R| / (R + 0.01 mean R) on the luminance of the indirect light, R the mean of both references.
The noise of R, half their difference, is part of it and taken off in squares. Rank: Spearman's correlation of
`indirect_error` with |I - R|.

Needs `pip install numpy scipy OpenEXR`.

    tests/bench/calibration.py build/release/bin/rcsplat ../shared/scenes -o /tmp/calibration > table.md
    tests/bench/calibration.py ... --settings '--target-error 10%' '--target-error 5%' '--target-error 3%'
"""
import argparse
import json
import pathlib
import resource
import subprocess
import sys

import numpy
import OpenEXR
from scipy.stats import spearmanr

LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])
SEEDS = 101, 202
# File, camera, paths a pixel of each reference.
VIEWS = [("sponza.glb", "atrium", 2048), ("sibenik.glb", "nave", 4096), ("castle.glb", "gate", 1024),
         ("cornell-box.glb", "", 4096),
         ("demo:cornell", "", 4096), ("demo:atrium", "", 4096), ("demo:spheres", "", 4096)]
SETTINGS = ["--accuracy 0.15 --rays 32 --noise 1", "--accuracy 0.4 --rays 1024 --noise 1",
            "--accuracy 0.2 --rays 128 --noise 0.06", "--accuracy 0.15 --rays 256 --noise 1"]


def luminance(path, layer):
    return OpenEXR.File(str(path)).channels()[layer].pixels[..., :3].astype(float) @ LUMINANCE


def run(arguments):
    result = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}\nfailed with {result.returncode}: {result.stderr.strip()}")
    return json.loads(result.stdout)


def references(args, stem, common, paths):
    files = []
    for seed in SEEDS:
        path = args.output / f"{stem}_{args.size}_{args.stride}_{paths}_{seed}.exr"
        if not path.exists():
            unfinished = path.with_suffix(".part.exr")
            run([args.rcsplat, "reference", *common, "--stride", args.stride, "--spp", paths, "--seed", seed, "--json",
                 "--pixel-format", "float", "-o", unfinished])
            unfinished.rename(path)
        files.append(luminance(path, "indirect"))
    return files


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measure(args, common, settings, first, second):
    picture = args.output / "picture.exr"
    before = cpu_seconds()
    stats = run([args.rcsplat, "render", *common, *settings.split(), "--json", "--pixel-format", "float", "-o",
                 picture])
    cpu = cpu_seconds() - before
    middle = slice(args.stride // 2, None, args.stride)
    image = luminance(picture, "indirect")[middle, middle]
    error = OpenEXR.File(str(picture)).channels()["indirect_error.Y"].pixels[middle, middle].astype(float)
    truth = (first + second) / 2
    floor = truth + 0.01 * truth.mean()
    mre = float((abs(image - truth) / floor).mean())
    noise = float((abs(first - second) / 2 / floor).mean())
    return {"mre": max(1e-6, mre**2 - noise**2) ** 0.5, "noise": noise, "mean": float(image.mean() / truth.mean()),
            "estimate": stats["error_estimate"]["indirect"]["mean_relative"],
            "rank": float(spearmanr(error.ravel(), abs(image - truth).ravel())[0]),
            "cpu": cpu, "seconds": stats["seconds"],
            "forecast": stats.get("forecast", {}).get("seconds")}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder for references")
    parser.add_argument("--size", type=int, default=400, help="width and height [px]")
    parser.add_argument("--stride", type=int, default=4,
                        help="references have every so-manyth pixel of each row and column")
    parser.add_argument("--settings", nargs="+", default=SETTINGS, help="options of rcsplat render, as one word each")
    parser.add_argument("--only", nargs="+", default=[""], help="parts of scene names to take")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    print("| view | settings | measured MRE | of it reference noise | estimated | ratio | rank | CPU [s] | wall [s] "
          "| forecast |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    ratios, ranks = [], []
    for name, camera, paths in VIEWS:
        if not any(part in name for part in args.only):
            continue
        scene = name if name.startswith("demo:") else args.scenes / name
        stem = name.replace(":", "_").removesuffix(".glb")
        common = [scene, *(["--camera", camera] if camera else []), "--size", f"{args.size}x{args.size}", "--aa", "1"]
        both = references(args, stem, common, paths)
        for settings in args.settings:
            row = measure(args, common, settings, *both)
            ratios.append(row["estimate"] / row["mre"])
            ranks.append(row["rank"])
            forecast = f"{row['forecast']:.1f}" if row["forecast"] else ""
            print(f"| {stem}{'/' + camera if camera else ''} | `{settings}` | {row['mre']:.1%} | {row['noise']:.1%} | "
                  f"{row['estimate']:.1%} | {ratios[-1]:.2f} | {row['rank']:.2f} | {row['cpu']:.1f} | "
                  f"{row['seconds']:.1f} | {forecast} |", flush=True)
    good = sum(0.67 <= r <= 1.5 for r in ratios)
    print(f"\n{good} of {len(ratios)} ratios in 0.67 to 1.5 ({min(ratios):.2f} to {max(ratios):.2f}); "
          f"rank at least 0.5 for {sum(r >= 0.5 for r in ranks)}, least {min(ranks):.2f}")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Renders every shared and built-in view against `rcsplat reference` and writes the table of errors and times
as Markdown. One set of options for all scenes. References are kept in the output folder and made only when missing,
so a run may be broken off and taken up again.

A reference has noise of its own, which counts as error of the picture. The table states it, as `rcsplat compare` does.
Views with more noise than --noise get as many more paths, up to --max-spp.

Needs `pip install flip-evaluator` (FLIP: Andersson et al. 2020).

    tests/bench/scene_table.py build/release/bin/rcsplat ../shared/scenes -o /tmp/table > table.md
"""
import argparse
import json
import math
import pathlib
import resource
import subprocess
import sys

import flip_evaluator

LIMITS = {"mre": 0.06, "bias": 0.01, "flip": 0.05}

SHARED = {
    "sponza.glb": ["atrium", "arcade", "gallery"],
    "sibenik.glb": ["nave", "choir", "aisle"],
    "castle.glb": ["courtyard", "gate", "arcade"],
    "cornell-box.glb": [""],
    "cornell-box-draco.glb": [""],
    "cornell-animated.glb": [""],
}
BUILT_IN = ["demo:cornell", "demo:atrium", "demo:spheres", "demo:furnace", "demo:closed-box", "demo:sphere-light",
            "demo:corner", "demo:ajar", "demo:blinds"]


def views(scenes):
    for name, cameras in SHARED.items():
        if (scenes / name).exists():
            for camera in cameras:
                yield str(scenes / name), camera
        else:
            print(f"{scenes / name} is missing: left out", file=sys.stderr)
    for name in BUILT_IN:
        yield name, ""


def flip(reference, image):
    return float(flip_evaluator.evaluate(str(reference), str(image), "LDR")[1])


def run(arguments):
    result = subprocess.run(arguments, capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}\nfailed with {result.returncode}: {result.stderr.strip()}")
    return json.loads(result.stdout) if result.stdout.startswith("{") else None


def noise(args, reference):
    """Mean relative error that the reference's own standard errors make."""
    return run([args.rcsplat, "compare", reference, reference, "--json"])["reference_noise"]


def children_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def trace(args, common, stem, spp):
    """The reference at that many paths a pixel: its EXR, PNG and statistics. Made only when missing."""
    name = f"{stem}_ref_{args.size}_{spp}"
    exr, png, kept = (args.output / f"{name}.{ending}" for ending in ("exr", "png", "json"))
    if not kept.exists():
        stats = run([args.rcsplat, "reference", *common, "--spp", str(spp), "--pixel-format", "float", "-o", exr,
                     "-o", png])
        kept.write_text(json.dumps(stats))
    return exr, png, json.loads(kept.read_text())


def trace_quietly(args, common, stem):
    spp = args.spp
    while True:
        exr, png, stats = trace(args, common, stem, spp)
        reached = noise(args, exr)
        if reached <= args.noise or spp >= args.max_spp:
            return exr, png, stats, spp, reached
        doublings = max(1, math.ceil(2.0 * math.log2(reached / args.noise)))
        spp = min(args.max_spp, spp * 2**doublings)


def measure(args, scene, camera, bounces):
    stem = f"{pathlib.Path(scene.replace(':', '_')).stem}_{camera or 'first'}_{bounces}"
    where = ["--camera", camera] if camera else []
    common = [scene, *where, "--size", args.size, "--aa", "1", "--bounces", str(bounces), "--json"]
    reference, reference_png, stats, spp, reference_noise = trace_quietly(args, common, stem)
    image, image_png = args.output / f"{stem}.exr", args.output / f"{stem}.png"
    before = children_seconds()
    run([args.rcsplat, "render", *common, *args.render.split(), "--pixel-format", "float", "--exposure",
         str(stats["tone_map"]["exposure"]), "-o", image, "-o", image_png])
    seconds = children_seconds() - before
    compared = run([args.rcsplat, "compare", image, reference, "--json"])
    return {
        "view": f"{pathlib.Path(scene).stem}{'/' + camera if camera else ''}", "bounces": bounces,
        "mre": compared["mean_relative_error"], "bias": compared["ratio_of_means"] - 1.0,
        "flip": flip(reference_png, image_png), "noise": reference_noise, "spp": spp, "seconds": seconds,
        "reference_seconds": stats["seconds"],
    }


def shown(row, key, text):
    """Bold where the limit is missed."""
    return f"**{text}**" if abs(row[key]) > LIMITS[key] else text


def print_row(row):
    print(f"| {row['view']} | {row['bounces']} | {shown(row, 'mre', format(row['mre'], '.1%'))} | {row['noise']:.1%} | "
          f"{shown(row, 'bias', format(row['bias'], '+.2%'))} | {shown(row, 'flip', format(row['flip'], '.3f'))} | "
          f"{row['seconds']:.1f} | {row['spp']:,} | {row['reference_seconds']:.0f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder for pictures and references")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--spp", type=int, default=256, help="paths a pixel at first")
    parser.add_argument("--max-spp", type=int, default=16384, help="paths a pixel at the most")
    parser.add_argument("--noise", type=float, default=2.0, help="noise wanted of a reference [%%]")
    parser.add_argument("--bounces", type=int, nargs="+", default=[1, 4])
    parser.add_argument("--only", nargs="+", default=[""], help="parts of scene/camera names to take")
    parser.add_argument("--render", default="",
                        help="options of rcsplat render, as one word: '--accuracy 0.1 --rays 512'")
    args = parser.parse_args()
    args.noise /= 100.0
    args.output.mkdir(parents=True, exist_ok=True)
    print(f"{args.size} pixels, one sample at each pixel's centre; render options: {args.render or 'defaults'}. "
          f"Limits: MRE {LIMITS['mre']:.0%}, bias {LIMITS['bias']:.0%}, FLIP {LIMITS['flip']}; **bold** misses one.\n")
    print("| view | bounces | MRE | of it reference noise | bias | FLIP | render, CPU [s] | reference paths | "
          "reference, wall [s] |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    rows = []
    for bounces in args.bounces:
        for scene, camera in views(args.scenes):
            if any(part in f"{scene}/{camera}" for part in args.only):
                rows.append(measure(args, scene, camera, bounces))
                print_row(rows[-1])
    print("\nWorst: " + ", ".join(f"{key} {max(abs(row[key]) for row in rows):.4f}" for key in LIMITS))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Renders every shared and built-in view against `rcsplat reference` and writes the table of errors and times
as Markdown. One set of options for all scenes. References are kept in the output folder and made only when missing,
so a run may be broken off and taken up again.

FLIP (Andersson et al. 2020) needs `pip install flip-evaluator`; without it the column stays empty.

    tests/bench/scene_table.py build/release/bin/rcsplat ../shared/scenes -o /tmp/table > table.md
"""
import argparse
import json
import pathlib
import subprocess
import sys

SHARED = {
    "sponza.glb": ["atrium", "arcade", "gallery"],
    "sibenik.glb": ["nave", "choir", "aisle"],
    "castle.glb": ["courtyard", "gate", "arcade"],
    "cornell-box.glb": [""],
    "cornell-box-draco.glb": [""],
    "cornell-animated.glb": [""],
}
BUILT_IN = ["demo:cornell", "demo:atrium", "demo:spheres", "demo:furnace", "demo:closed-box", "demo:sphere-light",
            "demo:corner"]


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
    try:
        import flip_evaluator
    except ImportError:
        return None
    return float(flip_evaluator.evaluate(str(reference), str(image), "LDR")[1])


def run(arguments):
    result = subprocess.run(arguments, capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}\nfailed with {result.returncode}: {result.stderr.strip()}")
    return json.loads(result.stdout) if result.stdout.startswith("{") else None


def measure(args, scene, camera, bounces):
    stem = f"{pathlib.Path(scene.replace(':', '_')).stem}_{camera or 'first'}_{bounces}"
    where = ["--camera", camera] if camera else []
    common = [scene, *where, "--size", args.size, "--aa", "1", "--bounces", str(bounces), "--json"]
    reference, reference_png = args.output / f"{stem}_ref.exr", args.output / f"{stem}_ref.png"
    kept = args.output / f"{stem}_ref_{args.size}_{args.spp}.json"
    if not kept.exists():
        stats = run([args.rcsplat, "reference", *common, "--spp", str(args.spp), "--pixel-format", "float",
                     "-o", reference, "-o", reference_png])
        kept.write_text(json.dumps(stats))
    stats = json.loads(kept.read_text())
    image, image_png = args.output / f"{stem}.exr", args.output / f"{stem}.png"
    rendered = run([args.rcsplat, "render", *common, *args.render.split(), "--pixel-format", "float", "--exposure",
                    str(stats["tone_map"]["exposure"]), "-o", image, "-o", image_png])
    compared = run([args.rcsplat, "compare", image, reference, "--json"])
    error = flip(reference_png, image_png)
    return {
        "view": f"{pathlib.Path(scene).stem}{'/' + camera if camera else ''}", "bounces": bounces,
        "mre": compared["mean_relative_error"], "bias": compared["ratio_of_means"] - 1.0, "flip": error,
        "seconds": rendered["seconds"], "reference_seconds": stats["seconds"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder for pictures and references")
    parser.add_argument("--size", default="200x200")
    parser.add_argument("--spp", type=int, default=4096)
    parser.add_argument("--bounces", type=int, nargs="+", default=[1, 4])
    parser.add_argument("--only", default="", help="part of a view's scene or camera name")
    parser.add_argument("--render", default="", help="options of rcsplat render, as one word: '--accuracy 0.1 --rays 512'")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    print(f"{args.size} pixels, reference {args.spp} paths a pixel, render options: {args.render or 'defaults'}\n")
    print("| view | bounces | MRE | bias | FLIP | render [s] | reference [s] |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    worst = {"mre": 0.0, "bias": 0.0, "flip": 0.0}
    for bounces in args.bounces:
        for scene, camera in views(args.scenes):
            if args.only not in f"{scene}/{camera}":
                continue
            row = measure(args, scene, camera, bounces)
            for key in worst:
                worst[key] = max(worst[key], abs(row[key] or 0.0))
            print(f"| {row['view']} | {bounces} | {100 * row['mre']:.1f} % | {100 * row['bias']:+.2f} % | "
                  f"{'' if row['flip'] is None else format(row['flip'], '.3f')} | {row['seconds']:.1f} | "
                  f"{row['reference_seconds']:.0f} |", flush=True)
    print(f"\nWorst: MRE {100 * worst['mre']:.1f} %, bias {100 * worst['bias']:.2f} %, FLIP {worst['flip']:.3f}")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""How the error of `rcsplat render` depends on roughness: for each of the 22 spheres of demo:spheres, in which
roughness goes from 0 to 1 in 11 steps, the ratio of its mean luminance to that of `rcsplat reference`, and how much
the ratio changes from one roughness to the next. With --seeds N the picture is the mean of N renders, which tells
noise of the picture from a step of the method: sigma is the standard error of the ratio, of the reference's noise and,
from two seeds on, of the renders'. Passes (exit 0) if no step is over the limit.

Needs `pip install numpy OpenEXR`.

    tests/bench/roughness_steps.py build/release/bin/rcsplat -o /tmp/steps --render '--accuracy 0.1 --rays 512'
"""
import argparse
import pathlib
import subprocess
import sys

import numpy
import OpenEXR

LIMIT = 0.02
LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])
# librcs/src/scene/demo_spheres.cpp states these too
EYE, TARGET, HEIGHT_ANGLE = numpy.array([0.0, 1.4, 7.6]), numpy.array([0.0, 1.1, 0.0]), 58.0
RADIUS = 0.32
ROWS = {"metal": 1.25, "plastic": 0.45}


def centre(row, step):
    return numpy.array([-3.6 + 0.72 * step, ROWS[row], 0.0])


def view_rays(width, height):
    """Unit directions through the pixels' centres, height x width x 3."""
    forward = (TARGET - EYE) / numpy.linalg.norm(TARGET - EYE)
    right = numpy.cross(forward, [0.0, 1.0, 0.0])
    right /= numpy.linalg.norm(right)
    up = numpy.cross(right, forward)
    scale = numpy.tan(numpy.radians(HEIGHT_ANGLE) / 2.0)
    x = (2.0 * (numpy.arange(width) + 0.5) / width - 1.0) * scale * width / height
    y = (1.0 - 2.0 * (numpy.arange(height) + 0.5) / height) * scale
    rays = forward + x[None, :, None] * right + y[:, None, None] * up
    return rays / numpy.linalg.norm(rays, axis=2, keepdims=True)


def covered(rays, point):
    """Pixels whose rays hit the sphere; nothing stands before any of them."""
    along = rays @ (point - EYE)
    return numpy.linalg.norm(point - EYE) ** 2 - along**2 < RADIUS**2


def luminance(path, layer):
    channels = OpenEXR.File(str(path)).channels()
    names = ("RGBA", "RGB") if layer == "beauty" else (layer,)
    return next(channels[name] for name in names if name in channels).pixels[..., :3] @ LUMINANCE


def run(arguments):
    result = subprocess.run(arguments, capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}\nfailed with {result.returncode}: {result.stderr.strip()}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder for pictures and references")
    parser.add_argument("--size", default="400x400")
    parser.add_argument("--spp", type=int, default=1024, help="paths a pixel of the reference")
    parser.add_argument("--bounces", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=1, help="renders to take the mean of")
    parser.add_argument("--render", default="",
                        help="options of rcsplat render, as one word: '--accuracy 0.1 --rays 512'")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    common = ["demo:spheres", "--size", args.size, "--aa", "1", "--bounces", str(args.bounces), "--pixel-format",
              "float", "-q"]
    reference_path = args.output / f"spheres_{args.bounces}_{args.size}_{args.spp}_ref.exr"
    if not reference_path.exists():
        run([args.rcsplat, "reference", *common, "--spp", str(args.spp), "-o", reference_path])
    images = []
    for seed in range(1, args.seeds + 1):
        path = args.output / f"spheres_{args.bounces}_{args.size}.exr"
        run([args.rcsplat, "render", *common, *args.render.split(), "--seed", str(seed), "-o", path])
        images.append(luminance(path, "beauty"))

    reference, error = luminance(reference_path, "beauty"), luminance(reference_path, "standard_error")
    rays = view_rays(reference.shape[1], reference.shape[0])
    print(f"{args.size} pixels, bounces {args.bounces}, reference {args.spp} paths a pixel, seeds {args.seeds}; "
          f"render options: {args.render or 'defaults'}\n")
    print("| row | roughness | pixels | render / reference | step | sigma |\n| --- | --- | --- | --- | --- | --- |")
    worst = 0.0
    for row in ROWS:
        previous = None
        for step in range(11):
            pixels = covered(rays, centre(row, step))
            total = reference[pixels].sum()
            ratios = [image[pixels].sum() / total for image in images]
            ratio = numpy.mean(ratios)
            sigma = numpy.sqrt((error[pixels] ** 2).sum()) / total
            if len(ratios) > 1:
                sigma = numpy.hypot(sigma, numpy.std(ratios, ddof=1) / numpy.sqrt(len(ratios)))
            change = 0.0 if previous is None else ratio / previous - 1.0
            worst = max(worst, abs(change))
            shown = "" if previous is None else f"{change:+.2%}"
            print(f"| {row} | {step / 10:.1f} | {pixels.sum()} | {ratio:.4f} | {shown} | {sigma:.2%} |")
            previous = ratio
    print(f"\nWorst step {worst:.2%}; limit {LIMIT:.0%}")
    return 1 if worst > LIMIT else 0


if __name__ == "__main__":
    sys.exit(main())

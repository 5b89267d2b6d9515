#!/usr/bin/env python3
"""Compares `rcsplat reference` with Mitsuba 3, which shares no line with it: `pip install mitsuba`.

    mitsuba_compare.py --rcsplat build/release/bin/rcsplat ../shared/scenes/cornell-box.glb sponza.glb:atrium glossy

Each scene is a .glb file, with :CAMERA where it has several; `glossy`, `sheen`, `anisotropy` and `diffuse-transmission`
are made here. For each, both render the same view with box-filtered pixels. Passes (exit 0) if the means agree within
1 % and the relative mean square error is no more than the two standard errors explain.

Mitsuba compiles by LLVM, from version 17 on (older ones abort, "Cannot select: fminimum"): DRJIT_LIBLLVM_PATH names
the library where it is not the system's.
"""

import argparse
import os
import subprocess
import sys
import tempfile

import numpy as np

try:
    import mitsuba as mi
except ImportError:
    sys.exit("mitsuba_compare.py needs Mitsuba 3: pip install mitsuba")

mi.set_variant("llvm_ad_rgb")  # before the modules that derive from its classes
import glossy_scene
import gltf
import mitsuba_scene


# Scenes that are made here.
MADE = ("glossy", "sheen", "anisotropy", "diffuse-transmission")


def load_scene(path, camera, size, sky, folder):
    scene = mitsuba_scene.scene_dict(path, folder)
    cameras = gltf.scene_of(gltf.Glb(path))[2]
    scene["sensor"] = mitsuba_scene.sensor_of(gltf.find_camera(cameras, camera, path), size)
    if sky > 0:
        scene["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": sky}}
    return mi.load_dict(scene)


def render_mitsuba(scene, bounces, samples):
    """Mean and standard error, from 16 independent images."""
    integrator = mi.load_dict({"type": "path", "max_depth": bounces + 2, "rr_depth": 1000})
    images = np.stack([np.array(mi.render(scene, integrator=integrator, spp=max(samples // 16, 1), seed=s + 1),
                                np.float64)[..., :3] for s in range(16)])
    return images.mean(0), images.std(0, ddof=1) / 4.0


def read_reference(path):
    layers = {name: np.array(bitmap, np.float64)[..., :3] for name, bitmap in mi.Bitmap(path).split()}
    beauty = layers.get("beauty", layers.get("<root>"))
    return beauty, layers["standard_error"]


def compare(scene, options, folder):
    path, _, camera = scene.partition(":")
    if path in MADE:
        path = os.path.join(folder, path + ".glb")
        glossy_scene.write_glossy(path, scene)
    exr = os.path.join(folder, "reference.exr")
    command = [options.rcsplat, "reference", path, "--size", f"{options.size}x{options.size}", "--spp",
               str(options.spp),
               "--bounces", str(options.bounces), "--aa", "64", "--pixel-format", "float", "-q", "-o", exr]
    command += ["--environment", f"{options.sky},{options.sky},{options.sky}" if options.sky > 0 else "none"]
    subprocess.run(command + (["--camera", camera] if camera else []), check=True)
    ours, our_error = read_reference(exr)
    theirs, their_error = render_mitsuba(load_scene(path, camera, options.size, options.sky, folder),
                                         options.bounces, options.spp)
    if options.keep:
        name = os.path.join(options.keep, os.path.basename(path).replace(".glb", "") + (f"-{camera}" if camera else ""))
        mi.Bitmap(theirs.astype(np.float32)).write(name + "-mitsuba.exr")
        mi.Bitmap(ours.astype(np.float32)).write(name + "-rcsplat.exr")
    epsilon = 0.01 * theirs.mean()
    scale = theirs ** 2 + epsilon ** 2
    found = np.mean((ours - theirs) ** 2 / scale)
    explained = np.mean((our_error ** 2 + their_error ** 2) / scale)
    mean_error = np.sqrt((our_error ** 2 + their_error ** 2).sum()) / theirs.sum()
    ratio = ours.mean() / theirs.mean()
    # 16 images tell their standard error within 18 %: relMSE, its square, within some 40 %.
    good = abs(ratio - 1) < 0.01 and found < 1.4 * explained
    print(f"{os.path.basename(scene):28} {theirs.mean():9.5f} {ratio:9.4f} {mean_error:9.4f} "
          f"{found:11.3e} {explained:11.3e}  {'ok' if good else 'DIFFERS'}", flush=True)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="FILE.glb[:CAMERA]|glossy")
    parser.add_argument("--rcsplat", default="build/release/bin/rcsplat")
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--bounces", type=int, default=3)
    parser.add_argument("--sky", type=float, default=0.0, help="constant radiance of the sky")
    parser.add_argument("--keep", metavar="FOLDER", help="write both images there")
    options = parser.parse_args()
    print(f"{'scene':28} {'mean':>9} {'ratio':>9} {'+-':>9} {'relMSE':>11} {'explained':>11}")
    good = True
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as folder:
            good = compare(scene, options, folder) and good
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()

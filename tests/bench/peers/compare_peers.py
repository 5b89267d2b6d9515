#!/usr/bin/env python3
"""Times rcsplat and other renderers on the same first bounce of diffuse light, and prints the tables of error and time
as Markdown, also to OUT/peers_SCENE_CAMERA_WxH.md.

    compare_peers.py build/release/bin/rcsplat ../shared/scenes/sponza.glb --camera atrium -o /tmp/peers

All are given a Lambertian copy of the scene (mean texture colours, no sky) and sample pixel centres. Errors are those
of `rcsplat compare --layer indirect` against `rcsplat reference`, which is kept in OUT. Whole processes are timed,
their loading and writing included; what a renderer needs done before (Radiance's octree, meshes in its format) is not.

The peers are optional, and what lacks is named and left out: numpy and pyradiance (`pip install pyradiance`), Mitsuba
(`pip install mitsuba`, and LLVM 17 or later, which DRJIT_LIBLLVM_PATH names), POV-Ray (`apt-get install povray`).
"""

import argparse
import os
import pathlib
import sys

try:
    import numpy  # noqa: F401, for the modules below
except ImportError:
    sys.exit("compare_peers.py needs numpy: pip install numpy")

import gltf
import images
import lambertian
import mitsuba_peer
import own
import povray_peer
import radiance_peer
import tables
from job import Job

CACHES = {"radiance": radiance_peer, "povray": povray_peer}


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat", type=pathlib.Path)
    parser.add_argument("scene", type=pathlib.Path, help="a .glb file")
    parser.add_argument("--camera", default="", help="default: the first")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder for pictures and references")
    parser.add_argument("--size", default="1000x1000", help="[px]")
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--peers", default="own,radiance,povray,mitsuba", help="of these, which")
    parser.add_argument("--render", action="append", metavar="OPTIONS",
                        help="options of rcsplat render, as one word, may be given several times; "
                             "default: a scan from coarse to fine")
    parser.add_argument("--spp", type=int, nargs="+", default=[64, 256, 1024],
                        help="paths a pixel of the own path tracer")
    parser.add_argument("--errors", type=float, nargs="+", default=[0.05, 0.1], help="where path tracers are compared")
    parser.add_argument("--reference-spp", type=int, default=65536)
    parser.add_argument("--stride", type=int, default=10, help="of the reference's pixels")
    args = parser.parse_args()
    unknown = set(args.peers.split(",")) - {"own", "mitsuba", *CACHES}
    if unknown:
        parser.error(f"--peers: {', '.join(sorted(unknown))} unknown, expected own, radiance, povray, mitsuba")
    return args


def make_job(args):
    folder = args.output.resolve() / args.scene.stem
    folder.mkdir(parents=True, exist_ok=True)
    glb = folder / f"{args.scene.stem}_lambertian.glb"
    lambertian.write_lambertian(args.scene, glb)
    width, height = map(int, args.size.split("x"))
    camera = gltf.find_camera(gltf.scene_of(gltf.Glb(glb))[2], args.camera, args.scene).name
    return Job(args.rcsplat.resolve(), glb, camera, width, height, folder, args.threads)


def judged(job, runs, reference):
    """The runs with their errors; a line on standard error for each as it ends."""
    result = []
    for run in runs:
        error = images.indirect_error(job.rcsplat, run.image, reference)
        run.mre, run.median = error["mean_relative_error"], error["median_relative_error"]
        run.bias = error["ratio_of_means"] - 1
        print(f"{run.renderer} {run.options}: CPU {run.cost.cpu:.1f} s, wall {run.cost.wall:.1f} s, MRE {run.mre:.4f}",
              file=sys.stderr, flush=True)
        result.append(run)
    return result


def compare(args):
    job = make_job(args)
    reference = own.reference(job, args.reference_spp, args.stride)
    wanted = args.peers.split(",")
    versions, absent = [own.version(job)], []
    splat = judged(job, own.splat_runs(job, args.render or own.SETTINGS), reference)
    caches, paths = [], []
    for name in wanted:
        if name == "own":
            paths += judged(job, own.path_runs(job, args.spp), reference)
            continue
        peer = CACHES.get(name, mitsuba_peer)
        reason = peer.missing(job)
        if reason:
            absent.append(f"Left out: {reason}.")
            continue
        versions.append(peer.version(job))
        (caches if name in CACHES else paths).extend(judged(job, peer.runs(job), reference))
    return job, "\n".join([
        f"### {args.scene.stem}/{job.camera}, {job.width} x {job.height}", "",
        f"{tables.machine()}. {'; '.join(versions)}. Reference: {args.reference_spp:,} paths a pixel, on a grid of "
        f"every {args.stride} pixels.", *absent, "",
        tables.run_table([*splat, *caches, *paths]), "", "At equal error (~ interpolated, ^ extrapolated):", "",
        tables.equal_table(splat, caches, paths, args.errors), ""])


def main():
    args = parse()
    job, text = compare(args)
    name = f"peers_{args.scene.stem}_{job.camera}_{job.width}x{job.height}.md"
    (args.output / name).write_text(text)
    print(text)


if __name__ == "__main__":
    main()

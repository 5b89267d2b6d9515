"""Mitsuba 3's path tracer, compiled by LLVM."""

import importlib.metadata
import importlib.util
import pathlib
import subprocess
import sys

import numpy as np

import images
import processes
from job import Job, Run

COUNTS = [16, 64, 256]  # paths a pixel
WORKER = pathlib.Path(__file__).with_name("mitsuba_worker.py")
PROBE = ("import mitsuba as mi; mi.set_variant('llvm_ad_rgb'); import drjit as dr; "
         "dr.eval(dr.minimum(mi.Float([1, 2]), mi.Float([2, 1])))")


def missing(_job):
    if importlib.util.find_spec("mitsuba") is None:
        return "no Mitsuba: pip install mitsuba"
    probe = subprocess.run([sys.executable, "-c", PROBE], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if probe.returncode != 0:
        return "Mitsuba finds no LLVM that it can use: name one from version 17 on in DRJIT_LIBLLVM_PATH"
    return None


def version(_job):
    return f"Mitsuba {importlib.metadata.version('mitsuba')} (llvm_ad_rgb)"


def runs(job: Job):
    folder = job.folder / "mitsuba"
    folder.mkdir(exist_ok=True)
    for spp in COUNTS:
        cost, full = trace(job, folder, spp, 3)
        _, direct = trace(job, folder, spp, 2)  # the same paths, cut off after direct light: not counted
        image = job.folder / f"mitsuba_{spp}.exr"
        images.write_indirect(image, full - direct)
        yield Run("Mitsuba path", f"{spp} spp", job.threads, cost, image)


def trace(job, folder, spp, depth):
    out = folder / "pixels.bin"
    cost = processes.timed([sys.executable, WORKER, job.glb, job.camera, job.width, job.height, spp, depth, folder,
                            out])
    return cost, np.fromfile(out, "<f4").reshape(job.height, job.width, 3)

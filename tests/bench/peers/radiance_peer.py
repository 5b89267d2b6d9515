"""Radiance's irradiance cache, as the package pyradiance brings it: rpict, and rtrace on several processes."""

import importlib.metadata
import importlib.util
import os
import pathlib
import subprocess

import numpy as np

import gltf
import images
import processes
import radiance_export
from job import Job, Run

# Ambient accuracy, divisions, super-samples, resolution: from coarse to fine.
SETTINGS = [
    "-aa .2 -ad 128 -as 32 -ar 32",
    "-aa .15 -ad 512 -as 256 -ar 128",
    "-aa .1 -ad 1024 -as 512 -ar 256",
]
# No statistics of light sources (-dt): direct light could not be taken off exactly.
COMMON = "-ab 1 -av 0 0 0 -aw 0 -dt 0 -lw 1e-6".split()
CENTRES = "-ps 1 -pt 0 -pj 0".split()  # a ray through every pixel's centre


def package():
    spec = importlib.util.find_spec("pyradiance")
    return pathlib.Path(spec.origin).parent if spec else None


def missing(_job):
    return None if package() else "no Radiance: pip install pyradiance"


def environment():
    return {**os.environ, "RAYPATH": f".:{package() / 'lib'}"}


def program(name):
    return package() / "bin" / name


def floats(job: Job, data):
    return np.frombuffer(data, "<f4").reshape(job.height, job.width, 3)


def output_of(command, folder, source=None):
    with open(source or os.devnull, "rb") as stdin:
        return subprocess.run([str(word) for word in command], cwd=folder, env=environment(), check=True, stdin=stdin,
                              stdout=subprocess.PIPE).stdout


def version(_job):
    text = output_of([program("rpict"), "-version"], None).decode().strip()
    return f"{text.title()} (pyradiance {importlib.metadata.version('pyradiance')})"


def runs(job: Job):
    folder = job.folder / "radiance"
    folder.mkdir(exist_ok=True)
    glb = gltf.Glb(job.glb)
    radiance_export.build_octree(glb, folder, package() / "bin", environment())
    view = radiance_export.view_text(gltf.find_camera(gltf.scene_of(glb)[2], job.camera, job.glb),
                                     job.width / job.height)
    frame = [*view.split(), "-x", job.width, "-y", job.height, "-pa", "0"]
    rays, octree = folder / "rays.bin", folder / "scene.oct"
    rays.write_bytes(output_of([program("vwrays"), "-ff", *frame], folder))
    paint = [program("rpict"), "-t", "0", *frame, *CENTRES, *COMMON]
    trace = [program("rtrace"), "-fff", "-h", *COMMON]
    # Each from its like: rpict's pictures have 8 bits a channel, and on lamps rounding would not cancel.
    _, direct_picture = picture_of(job, folder, [*paint, "-ab", "0", octree], "direct")
    direct_values = floats(job, output_of([*trace, "-ab", "0", octree], folder, rays))
    for i, options in enumerate(SETTINGS):
        cost, picture = picture_of(job, folder, [*paint, *options.split(), octree], f"rpict_{i}")
        yield indirect(job, "Radiance rpict", options, 1, cost, picture - direct_picture, f"rpict_{i}")
        ambient, values = folder / f"ambient_{i}.amb", folder / f"rtrace_{i}.bin"
        ambient.unlink(missing_ok=True)  # else the next run would find this one's work done
        command = [*trace, *options.split(), "-n", job.threads, "-af", ambient, octree]
        cost = processes.timed(command, stdin=rays, stdout=values, cwd=folder, env=environment())
        yield indirect(job, f"Radiance rtrace -n {job.threads}", options, job.threads, cost,
                       floats(job, values.read_bytes()) - direct_values, f"rtrace_{i}")


def picture_of(job, folder, command, name):
    picture = folder / f"{name}.hdr"
    cost = processes.timed(command, stdout=picture, cwd=folder, env=environment())
    return cost, floats(job, output_of([program("pvalue"), "-h", "-H", "-df", picture], folder))


def indirect(job, renderer, options, threads, cost, pixels, name):
    image = job.folder / f"{name}.exr"
    images.write_indirect(image, pixels)
    return Run(renderer, options, threads, cost, image)

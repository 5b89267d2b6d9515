"""rcsplat itself: by splatted records, by path tracing, and the truth both are judged by."""

import subprocess

import processes
from job import Job, Run

# From coarse to fine; at equal error the cheapest counts.
SETTINGS = [
    "--accuracy 0.4 --rays 32 --noise 0.15",
    "--accuracy 0.3 --rays 48 --noise 0.12",
    "--accuracy 0.3 --rays 64 --noise 0.1",
    "--target-error 10%",
    "--target-error 7%",
    "--target-error 5%",
    "--target-error 4%",
    "--target-error 3%",
    "--accuracy 0.2 --rays 128 --noise 0.02",
]
REFERENCE_SEED = 20051  # apart from the path tracer's own runs, which must not share their noise with the truth


def common(job: Job):
    return [job.glb, *(["--camera", job.camera] if job.camera else []), "--size", f"{job.width}x{job.height}",
            "--environment", "none", "--bounces", "1", "--aa", "1", "--layers", "indirect", "--threads", job.threads,
            "-q"]


def version(job: Job):
    text = subprocess.run([job.rcsplat, "--version"], check=True, text=True, stdout=subprocess.PIPE).stdout.strip()
    return text if text.startswith("rcsplat") else f"rcsplat {text}"


def reference(job: Job, spp, stride):
    """The truth: made once for a view, a size and a number of paths, then kept."""
    path = job.folder / f"reference_{job.width}x{job.height}_{spp}_{stride}.exr"
    if not path.exists():
        processes.timed([job.rcsplat, "reference", *common(job), "--pixel-format", "float", "--spp", spp, "--stride",
                         stride,
                         "--seed", REFERENCE_SEED, "-o", path])
    return path


def splat_runs(job: Job, settings):
    for i, options in enumerate(settings):
        image = job.folder / f"rcsplat_{i}.exr"
        cost = processes.timed([job.rcsplat, "render", *common(job), *options.split(), "-o", image])
        yield Run("rcsplat render", options, job.threads, cost, image)


def path_runs(job: Job, counts):
    for spp in counts:
        image = job.folder / f"paths_{spp}.exr"
        cost = processes.timed([job.rcsplat, "reference", *common(job), "--spp", spp, "-o", image])
        yield Run("rcsplat reference", f"--spp {spp}", job.threads, cost, image)

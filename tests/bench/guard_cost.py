#!/usr/bin/env python3
"""What the guards against numerical trouble cost: sponza with and without them, in pairs.

    tests/bench/guard_cost.py SCENE [--camera NAME] [--pairs 9] [--work DIR]

There is no switch for them in the product: guards.json says how the source would read without them, which is put into
the copy of the sources that tests/mutation/run.py builds in. Two clamps without which no render would end (of the turn
of normals, of rays in the tangent plane: an instruction each) stay. Pairs alternate in order; what is compared is
processor time, of the render alone as --stats has it; wall time is printed as well. Ends with 1 if the guards cost more
than 3 %.
"""

import argparse
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "mutation"))
import run as mutation  # noqa: E402

MOST_COST = 0.03


def apply(source, guards):
    """@return the files' texts as they were"""
    before = {}
    for guard in guards:
        path = source / guard["file"]
        text = path.read_text()
        before.setdefault(path, text)
        if text.count(guard["find"]) != 1:
            sys.exit("error: guard %s applies %d times in %s" %
                     (guard["name"], text.count(guard["find"]), guard["file"]))
        path.write_text(text.replace(guard["find"], guard["replace"]))
    return before


def render(folder, scene, camera, size):
    """@return processor time and wall time of the stages after loading [s]"""
    with tempfile.TemporaryDirectory() as scratch:
        stats = pathlib.Path(scratch) / "stats.json"
        begin = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([folder / "bin" / "rcsplat", "render", scene, *(["--camera", camera] if camera else []),
                        "--size", size, "-q",
                        "-o", pathlib.Path(scratch) / "a.exr", "--stats", stats], check=True)
        end = resource.getrusage(resource.RUSAGE_CHILDREN)
        wall = sum(seconds for stage, seconds in json.loads(stats.read_text())["stage_seconds"].items()
                   if stage not in ("load", "write"))
        return end.ru_utime - begin.ru_utime, wall


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--camera", default="")
    parser.add_argument("--size", default="500x500")
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--work", default=mutation.ROOT / "build" / "mutation", type=pathlib.Path)
    arguments = parser.parse_args()
    jobs = os.cpu_count() or 1
    guards = json.loads((HERE / "guards.json").read_text())
    work = arguments.work.resolve()
    source, folder = work / "source", work / "build"
    mutation.copy_sources(source)
    if problem := mutation.build(source, folder, jobs):
        sys.exit("error: the copy does not build:\n" + problem)
    kept = work / "guarded"
    subprocess.run(["cmake", "-E", "rm", "-rf", kept], check=True)
    subprocess.run(["cmake", "-E", "make_directory", kept], check=True)
    for part in ("bin", "lib"):
        subprocess.run(["cp", "-a", folder / part, kept], check=True)  # its run path is relative
    before = apply(source, guards)
    try:
        problem = mutation.build(source, folder, jobs)
    finally:
        for path, text in before.items():
            path.write_text(text)
    if problem:
        sys.exit("error: the copy does not build without guards:\n" + problem)
    print("without: " + ", ".join(guard["name"] for guard in guards), flush=True)
    processor, wall = [], []
    for pair in range(arguments.pairs + 1):
        order = [kept, folder] if pair % 2 == 0 else [folder, kept]
        times = {which: render(which, arguments.scene, arguments.camera, arguments.size) for which in order}
        if pair == 0:
            continue  # warms the disk's cache
        processor.append(times[kept][0] / times[folder][0] - 1.0)
        wall.append(times[kept][1] / times[folder][1] - 1.0)
        print("pair %d: with %.2f s, without %.2f s of processor time: %+.1f %%" %
              (pair, times[kept][0], times[folder][0], 100 * processor[-1]), flush=True)
    median = statistics.median(processor)
    spread = sorted(processor)
    print("guards cost %.1f %% of the processor time (median of %d pairs, from %.1f to %.1f %%), "
          "%.1f %% of the wall time" % (100 * median, len(processor), 100 * spread[0], 100 * spread[-1],
                                        100 * statistics.median(wall)))
    sys.exit(0 if median <= MOST_COST else 1)


if __name__ == "__main__":
    main()

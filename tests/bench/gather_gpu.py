#!/usr/bin/env python3
"""Renders scenes with rays of records by the processor and by the graphics device, and prints as Markdown how long
records took, how many rays that was a second, and what the pictures differ by.

    tests/bench/gather_gpu.py build/release/bin/rcsplat demo:cornell demo:atrium ../shared/scenes/sponza.glb > table.md

Times are the least of --repeats runs; the first run of a device, which compiles shaders, is left out.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat", type=pathlib.Path)
    parser.add_argument("scenes", nargs="+", help="files and built-in scenes")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--device", type=int, default=-1)
    parser.add_argument("--more", default="", help="further options of rcsplat render")
    return parser.parse_args()


def run(arguments, *words):
    done = subprocess.run([str(arguments.rcsplat), *map(str, words)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


def render(arguments, scene, method, folder):
    """The least time of records [s], and what --stats says of that run."""
    best = None
    for i in range(arguments.repeats + (method == "gpu")):
        stats = folder / "stats.json"
        run(arguments, "render", scene, "--size", arguments.size, "--aa", 1, "--gather", method, "--device",
            arguments.device, *arguments.more.split(), "-q", "--pixel-format", "float", "-o", folder / f"{method}.exr",
            "--stats", stats)
        said = json.loads(stats.read_text())
        if method == "gpu" and i == 0:
            continue
        seconds = said["stage_seconds"]["records"]
        if best is None or seconds < best[0]:
            best = (seconds, said)
    return best


def main():
    arguments = parse()
    print("| scene | gathered by | records [s] | million rays a second | MRE to the processor |")
    print("| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene in arguments.scenes:
            for method in ("cpu", "gpu"):
                seconds, said = render(arguments, scene, method, folder)
                counts = said["rays"]
                rays = counts["hemisphere"] + counts["hemisphere_shadow"]
                off = ""
                if method == "gpu":
                    words = run(arguments, "compare", folder / "gpu.exr", folder / "cpu.exr")
                    off = re.search(r"MRE\s+(\S+ %)", words).group(1)
                by = said["gl"]["renderer"] if said["gather_method"] == "gpu" else f"{said['threads']} threads"
                print(f"| {pathlib.Path(scene).name} | {by} | {seconds:.2f} | {1e-6 * rays / seconds:.2f} | {off} |",
                      flush=True)


if __name__ == "__main__":
    main()

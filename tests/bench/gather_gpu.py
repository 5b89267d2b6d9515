#!/usr/bin/env python3
"""Renders scenes by the processor and by the graphics device (--gather gpu --splat gpu-tiles), and prints as Markdown
how long records took, what the two pictures differ by, and how far the indirect
light of each is from a reference.

    tests/bench/gather_gpu.py build/release/bin/rcsplat --folder ../shared/scenes --size 160x100 \\
        --into docs/method.md

Besides the scenes given, all built-in ones (--no-demos leaves them out) and those of a folder. Times are the least of
--repeats runs; the first run of a device, which compiles shaders, is left out where there are several. --into FILE
writes the table, with the command, between the two lines of that file that say `gather_gpu.py`. Ends with 1 where
pictures differ by more than --limit.

A machine that has a graphics card and little else takes two steps: there `--keep DIR` renders and compares nothing,
then `--from DIR` makes the table elsewhere, of the scenes that were kept.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

WAYS = {"cpu": ["--gather", "cpu", "--splat", "tiles"], "gpu": ["--gather", "gpu", "--splat", "gpu-tiles"]}
BEGIN, END = "<!-- gather_gpu.py: begin -->\n", "<!-- gather_gpu.py: end -->\n"


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*", help="files and built-in scenes")
    parser.add_argument("--folder", type=pathlib.Path, help="of scenes: all its .glb")
    parser.add_argument("--no-demos", action="store_true", help="not the built-in scenes")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--device", type=int, default=-1)
    parser.add_argument("--threads", type=int, default=0, help="of the processor's way; 0: all. The device's has all")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for pictures and statistics: nothing else is done")
    parser.add_argument("--from", dest="kept", type=pathlib.Path, help="folder that --keep has filled")
    parser.add_argument("--spp", type=int, default=4096, help="paths a pixel of the reference; 0: none")
    parser.add_argument("--stride", type=int, default=4, help="of the reference's pixels")
    parser.add_argument("--limit", type=float, default=0.2, help="on the MRE between the pictures [%%]")
    parser.add_argument("--more", default="", help="further options of rcsplat render")
    parser.add_argument("--into", type=pathlib.Path, help="file to write the table into")
    return parser.parse_args()


def run(arguments, *words, may_fail=False):
    done = subprocess.run([str(arguments.rcsplat), *map(str, words)], capture_output=True, text=True)
    if done.returncode and not may_fail:
        sys.exit(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout + done.stderr


def are_kept(arguments, scene):
    return all((arguments.kept / kept_name(scene, way, "json")).exists() for way in WAYS)


def scenes_of(arguments):
    demos = []
    if not arguments.no_demos:
        said = run(arguments, "render", "demo:", "-o", "none.png", may_fail=True)
        demos = list(dict.fromkeys(re.findall(r"demo:[\w-]+", said)))
    files = sorted(arguments.folder.glob("*.glb")) if arguments.folder else []
    scenes = demos + [scene for scene in arguments.scenes if scene not in demos] + files
    if not arguments.kept:
        return scenes
    missing = [scene for scene in arguments.scenes if not are_kept(arguments, scene)]
    kept = [scene for scene in scenes if are_kept(arguments, scene)]
    if missing or not kept:
        sys.exit(f"{arguments.kept} has nothing of {', '.join(missing) or 'any scene'}")
    return kept


def kept_name(scene, way, ending):
    return f"{pathlib.Path(scene).name.replace(':', '-')}.{way}.{ending}"


def render(arguments, scene, way, folder):
    """The least time of records [s], and what --stats says of that run."""
    best = None
    threads = arguments.threads if way == "cpu" else 0
    for i in range(arguments.repeats + (way == "gpu" and arguments.repeats > 1)):
        stats = folder / kept_name(scene, way, "json")
        run(arguments, "render", scene, "--size", arguments.size, "--aa", 1, *WAYS[way], "--device", arguments.device,
            "--threads", threads, *arguments.more.split(), "-q", "--layers", "indirect", "--pixel-format", "float",
            "-o", folder / kept_name(scene, way, "exr"), "--stats", stats)
        said = json.loads(stats.read_text())
        if way == "gpu" and (said["gather_method"], said["splat_method"]) != ("gpu", "gpu-tiles"):
            sys.exit(f"{scene}: the device did not do it: {said['gather_method']}, {said['splat_method']}")
        if way == "gpu" and i == 0 and arguments.repeats > 1:
            continue
        seconds = said["stage_seconds"]["records"]
        if best is None or seconds < best[0]:
            best = (seconds, said)
    (folder / kept_name(scene, way, "json")).write_text(json.dumps(best[1]))
    return best


def error(arguments, a, b, layer="beauty", figure="MRE"):
    """Mean or median relative error [%]"""
    return float(re.search(figure + r"\s+(\S+) %", run(arguments, "compare", a, b, "--layer", layer)).group(1))


def row_of(arguments, scene, folder):
    """A line of the table, and the MRE between the pictures [%]."""
    if arguments.kept:
        folder = arguments.kept
        kept = {way: json.loads((folder / kept_name(scene, way, "json")).read_text()) for way in WAYS}
        said = {way: (stats["stage_seconds"]["records"], stats) for way, stats in kept.items()}
    else:
        said = {way: render(arguments, scene, way, folder) for way in WAYS}
    pictures = {way: folder / kept_name(scene, way, "exr") for way in WAYS}
    between = error(arguments, pictures["gpu"], pictures["cpu"])
    errors = ["", ""]
    if arguments.spp:
        reference = folder / kept_name(scene, "reference", "exr")
        run(arguments, "reference", scene, "--size", arguments.size, "--aa", 1, "--spp", arguments.spp, "--stride",
            arguments.stride, "-q", "-o", reference)
        # The mean of so few pixels is that of one or two that next to no light reaches.
        errors = [f"{error(arguments, pictures[way], reference, 'indirect', 'median'):.2f}" for way in WAYS]
    rates = []
    for seconds, stats in said.values():
        rays = stats["rays"]
        rates.append(f"{1e-6 * (rays['hemisphere'] + rays['hemisphere_shadow']) / max(seconds, 1e-9):.2f}")
    counts = [stats["records"] for _, stats in said.values()]
    number = str(counts[0]) if counts[0] == counts[1] else " and ".join(map(str, counts))
    cells = [pathlib.Path(scene).name, number, *(f"{seconds:.2f}" for seconds, _ in said.values()), *rates,
             f"{between:.4f}", *errors]
    return "| " + " | ".join(cells) + " |\n", between


def write_into(path, text):
    whole = path.read_text()
    if whole.count(BEGIN) != 1 or whole.count(END) != 1:
        sys.exit(f"{path} lacks the lines {BEGIN.strip()} and {END.strip()}")
    head, rest = whole.split(BEGIN)
    path.write_text(head + BEGIN + text + END + rest.split(END)[1])


def keep(arguments):
    arguments.keep.mkdir(parents=True, exist_ok=True)
    for scene in scenes_of(arguments):
        seconds = {way: render(arguments, scene, way, arguments.keep)[0] for way in WAYS}
        print(pathlib.Path(scene).name, *(f"{way} {s:.2f} s" for way, s in seconds.items()), flush=True)


def main():
    arguments = parse()
    if arguments.keep:
        return keep(arguments)
    table = ("| scene | records | by processor [s] | by device [s] | million rays a second | by device "
             "| MRE between them [%] | median error of indirect light, processor [%] | device [%] |\n"
             "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n")
    print(table, end="", flush=True)
    worst = 0.0
    with tempfile.TemporaryDirectory() as name:
        for scene in scenes_of(arguments):
            row, between = row_of(arguments, scene, pathlib.Path(name))
            worst = max(worst, between)
            table += row
            print(row, end="", flush=True)
    if arguments.into:
        command = " ".join(["tests/bench/gather_gpu.py", *sys.argv[1:]])
        write_into(arguments.into, f"\n`{command}`:\n\n{table}\n")
    if worst > arguments.limit:
        sys.exit(f"pictures differ by {worst:.4f} %, more than {arguments.limit} %")


if __name__ == "__main__":
    main()

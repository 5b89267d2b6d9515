#!/usr/bin/env python3
"""Damages scene files in many ways and renders each: there has to be a picture or one clear error.

    tests/corpus/write_corpus build/seeds          # a program of the build: seeds, one folder each
    tests/fuzz/mutate_scenes.py build/asan/bin/rcsplat build/seeds ../shared/scenes --count 2000

A failure is a signal, a sanitizer's report, an internal error, an exit code that is none of ours, no picture after
success, more than 10 s of processor time, or more than 4 GB. Failing files are kept with what was said. What is made
from a seed file depends on --seed and the number alone, so a failure can be made again by --only N.
"""

import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import random
import resource
import shutil
import struct
import subprocess
import sys
import tempfile

SECONDS = 10  # of processor time: wall time on a busy machine says nothing
WALL_SECONDS = 120  # ... but sleeping for ever is a hang as well
MEGABYTES = 4096
LARGEST_SEED = 200_000  # [bytes]; larger files would only make the run longer
ABSURD = [0, -1, 1, 2, 255, 65535, 2**31 - 1, -(2**31), 2**32 - 1, 2**32, 2**63 - 1, 2**64, 10**30, 0.5, -0.0, 1e-38,
          1e38, 1e308, -1e308, 3.5e38, math.nan, math.inf, -math.inf, "", "x", None, True, [], {}, [0] * 17]
FLOATS = [math.nan, math.inf, -math.inf, 1e38, -1e38, 3.4e38, 1e-45, 0.0, 1e18, -1e-30]


def split_glb(data):
    """@return the JSON text and the other chunks' bytes, or None if `data` is no binary glTF"""
    if len(data) < 20 or data[:4] != b"glTF":
        return None
    length, = struct.unpack_from("<I", data, 12)
    return (data[20:20 + length], data[20 + length:]) if data[16:20] == b"JSON" else None


def join_glb(text, rest):
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I", len(text)) + b"JSON" + text + rest
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def places(value, path=()):
    """All (container, key) of a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in list(items):
        yield value, key
        yield from places(inner, path + (key,))


def flip_bits(rng, data):
    out = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 4, 16, 64])):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def truncate(rng, data):
    return data[:rng.randrange(len(data))]


def overwrite(rng, data):
    out = bytearray(data)
    begin = rng.randrange(len(out))
    size = min(rng.choice([1, 4, 16, 256, 4096]), len(out) - begin)
    out[begin:begin + size] = rng.choice([b"\0" * size, b"\xff" * size, rng.randbytes(size)])
    return bytes(out)


def splice(rng, data):
    a, b = sorted(rng.randrange(len(data)) for _ in range(2))
    return data[:b] + data[a:b] + data[b:] if rng.random() < 0.5 else data[:a] + data[b:]


def in_document(rng, data, change):
    parts = split_glb(data)
    try:
        document = json.loads(parts[0] if parts else data)
    except (ValueError, RecursionError):
        return flip_bits(rng, data)
    for _ in range(rng.choice([1, 1, 2, 4])):
        change(document)
    text = json.dumps(document).encode()
    return join_glb(text, parts[1]) if parts else text


def absurd_value(rng, data):
    def change(document):
        found = [(c, k) for c, k in places(document) if not isinstance(c[k], (dict, list)) or rng.random() < 0.1]
        if found:
            container, key = rng.choice(found)
            container[key] = rng.choice(ABSURD)
    return in_document(rng, data, change)


def absurd_count(rng, data):
    def change(document):
        names = ("count", "byteLength", "byteOffset", "byteStride", "bufferView", "buffer", "indices", "componentType",
                 "mesh", "source", "input", "output", "skeleton", "camera", "texture", "index", "POSITION", "NORMAL",
                 "TEXCOORD_0")
        found = [(c, k) for c, k in places(document) if k in names]
        if found:
            container, key = rng.choice(found)
            container[key] = rng.choice(ABSURD[:15] + [rng.randrange(2**32)])
    return in_document(rng, data, change)


def cycle(rng, data):
    def change(document):
        nodes = document.get("nodes") if isinstance(document, dict) else None
        if isinstance(nodes, list) and nodes:
            node = rng.choice(nodes)
            if isinstance(node, dict):
                node["children"] = [rng.randrange(len(nodes) + 1) for _ in range(rng.choice([1, 2, 300]))]
    return in_document(rng, data, change)


def remove_or_repeat(rng, data):
    def change(document):
        found = list(places(document))
        if not found:
            return
        container, key = rng.choice(found)
        if isinstance(container, dict):
            del container[key]
        elif rng.random() < 0.5:
            container.pop(key)
        else:
            container.extend([container[key]] * rng.choice([1, 3, 1000]))
    return in_document(rng, data, change)


def odd_floats(rng, data):
    parts = split_glb(data)
    if not parts or len(parts[1]) < 16:
        return overwrite(rng, data)
    rest = bytearray(parts[1])
    for _ in range(rng.choice([1, 4, 64])):
        struct.pack_into("<f", rest, 8 + 4 * rng.randrange((len(rest) - 8) // 4), rng.choice(FLOATS))
    return join_glb(parts[0], bytes(rest))


MUTATIONS = [flip_bits, truncate, overwrite, splice, absurd_value, absurd_count, cycle, remove_or_repeat, odd_floats]


def find_seeds(folders):
    """Scene files with the folder of what lies beside them; corpus folders hold one scene each."""
    seeds = []
    for folder in folders:
        for path in sorted(pathlib.Path(folder).rglob("*")):
            if path.suffix in (".glb", ".gltf") and path.is_file() and 0 < path.stat().st_size <= LARGEST_SEED:
                seeds.append(path)
    return seeds


def limits():
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 2))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


# Of rcsplat, for what a scene file may be: nothing of the machine's, no defect.
OURS = (1, 2, 65, 66, 75)


def verdict(code, said, picture, kilobytes):
    """@return what is wrong, or None"""
    for word in ("AddressSanitizer", "runtime error:", "LeakSanitizer", "UndefinedBehavior", "internal error"):
        if word in said:
            return word
    if code in (-24, -9):
        return "hang: more than %d s of processor time" % SECONDS
    if code == "wall":
        return "hang: more than %d s" % WALL_SECONDS
    if kilobytes > MEGABYTES * 1024:
        return "memory: %d MB" % (kilobytes // 1024)
    if code == 0:
        return None if picture else "success without a picture"
    if code not in OURS:
        return "exit code %s" % code
    if picture:
        return "an error and a picture"
    return None if said.count("rcsplat: error: ") == 1 else "failure without one error line"


def run_one(program, seeds, seed, number):
    rng = random.Random("%d %d" % (seed, number))
    source = rng.choice(seeds)
    mutation = rng.choice(MUTATIONS)
    data = mutation(rng, source.read_bytes())
    folder = pathlib.Path(tempfile.mkdtemp(prefix="rcs-mutant-"))
    inside = folder / "scene"
    if source.parent.name.startswith("seed-"):  # a folder of its own: take what lies beside the scene along
        shutil.copytree(source.parent, inside, symlinks=True)
    else:
        inside.mkdir()
    scene = inside / source.name
    scene.unlink(missing_ok=True)
    scene.write_bytes(data)
    picture = folder / "out.png"
    environment = dict(os.environ, ASAN_OPTIONS="exitcode=99:detect_leaks=0:hard_rss_limit_mb=%d" % MEGABYTES,
                       LP_NUM_THREADS="1")
    command = [program, "render", str(scene), "--size", "64x64", "--threads", "1", "-q", "-o", str(picture)]
    log = folder / "log"
    with open(log, "wb") as out:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, env=environment,
                                   preexec_fn=limits)
        timer = concurrent.futures.thread.threading.Timer(WALL_SECONDS, process.kill)
        timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = 0  # reaped above
        late = not timer.is_alive()
        timer.cancel()
    code = "wall" if late else os.waitstatus_to_exitcode(status)
    said = log.read_text(errors="replace")
    wrong = verdict(code, said, picture.exists(), usage.ru_maxrss)
    return dict(number=number, source=source.name if source.parent.name[:5] != "seed-" else source.parent.name,
                mutation=mutation.__name__, code=code, wrong=wrong, folder=folder,
                seconds=usage.ru_utime + usage.ru_stime, megabytes=usage.ru_maxrss / 1024, command=command)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("seeds", nargs="+", help="folders with scene files")
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="number of the first file")
    parser.add_argument("--only", type=int, help="make and render this one alone, and keep it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", default="mutants", help="folder for failing files")
    arguments = parser.parse_args()
    seeds = find_seeds(arguments.seeds)
    if not seeds:
        sys.exit("no .glb or .gltf of at most %d bytes in %s" % (LARGEST_SEED, ", ".join(arguments.seeds)))
    numbers = [arguments.only] if arguments.only is not None else range(arguments.first,
                                                                        arguments.first + arguments.count)
    pictures = errors = 0
    slowest = heaviest = 0.0
    failures = []
    by_mutation = {}
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for result in pool.map(lambda n: run_one(arguments.program, seeds, arguments.seed, n), numbers):
            slowest = max(slowest, result["seconds"])
            heaviest = max(heaviest, result["megabytes"])
            pictures += result["code"] == 0
            errors += result["code"] in (1, 2)
            row = by_mutation.setdefault(result["mutation"], [0, 0, 0])
            row[0 if result["wrong"] else 1 if result["code"] == 0 else 2] += 1
            if result["wrong"] or arguments.only is not None:
                kept = pathlib.Path(arguments.keep) / str(result["number"])
                shutil.rmtree(kept, ignore_errors=True)
                kept.parent.mkdir(parents=True, exist_ok=True)
                shutil.move(str(result["folder"]), kept)
            if result["wrong"]:
                failures.append(result)
                print("FAIL %d: %s of %s: %s" % (result["number"], result["mutation"], result["source"],
                                                 result["wrong"]),
                      flush=True)
            shutil.rmtree(result["folder"], ignore_errors=True)
            if (pictures + errors + len(failures)) % 200 == 0:
                print("%d pictures, %d errors, %d failures so far" % (pictures, errors, len(failures)), flush=True)
    print("%d files from %d seeds: %d pictures, %d errors, %d failures; slowest %.1f s of processor time, "
          "most memory %.0f MB"
          % (len(numbers), len(seeds), pictures, errors, len(failures), slowest, heaviest))
    for name, (wrong, fine, refused) in sorted(by_mutation.items()):
        print("  %-18s %4d pictures %4d errors %4d failures" % (name, fine, refused, wrong))
    if failures:
        print("kept in %s" % arguments.keep)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""How time and memory of `rcsplat render` grow: over pixels, triangles (all different, and instanced), lamps, bounces,
passes, records and threads. Renders each setting three times in turn, by default with built-in scenes and ones that it
makes itself, and prints one Markdown table for each, made whole: medians, and the exponent that the growth of processor
time from row to row shows (1: in proportion).

    tests/bench/scale_curves.py build/release/bin/rcsplat -o /tmp/scale > scale.md

Takes half an hour on two cores; --only pixels lamps takes parts of it, --largest 0.1 leaves out the largest rows.
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import statistics
import struct
import subprocess
import sys

import numpy

ROOM = 4.0  # m


def glb(path, meshes, nodes, camera):
    """meshes: (name, positions, triangles, material); nodes: (mesh, translation)"""
    blob, views, accessors, gltf_meshes = b"", [], [], []

    def accessor(array, component, kind, limits):
        nonlocal blob
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        blob += array.tobytes()
        blob += b"\0" * (-len(blob) % 4)
        entry = {"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind}
        if limits:
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        accessors.append(entry)
        return len(accessors) - 1

    for name, positions, triangles, material in meshes:
        attributes = {"POSITION": accessor(positions.astype("<f4"), 5126, "VEC3", True)}
        indices = accessor(triangles.astype("<u4").reshape(-1), 5125, "SCALAR", False)
        gltf_meshes.append({"name": name, "primitives": [
            {"attributes": attributes, "indices": indices, "material": material}]})
    gltf_nodes = [{"mesh": mesh, "translation": list(map(float, at))} for mesh, at in nodes]
    gltf_nodes.append({"camera": 0, "translation": list(camera)})
    root = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(gltf_nodes)))}],
        "nodes": gltf_nodes, "meshes": gltf_meshes, "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.01}}],
        "materials": [
            {"name": "plaster", "doubleSided": True,
             "pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.55, 0.5, 1], "metallicFactor": 0}},
            {"name": "lamp", "doubleSided": True, "emissiveFactor": [1, 0.9, 0.8],
             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 20.0}},
             "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}}],
        "extensionsUsed": ["KHR_materials_emissive_strength"],
    }
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as out:
        out.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(blob)))
        out.write(struct.pack("<I4s", len(text), b"JSON") + text)
        out.write(struct.pack("<I4s", len(blob), b"BIN\0") + blob)


def quads(corners, u, v):
    """One for each corner, with edges u and v."""
    corners = numpy.asarray(corners, dtype=float)
    positions = numpy.stack([corners, corners + u, corners + numpy.add(u, v), corners + v], axis=1).reshape(-1, 3)
    first = 4 * numpy.arange(len(corners))[:, None]
    return positions, numpy.concatenate([first + [0, 1, 2], first + [0, 2, 3]], axis=1).reshape(-1, 3)


def walls():
    r, h = ROOM, 0.75 * ROOM
    sides = [quads([[-r, 0, -r]], (2 * r, 0, 0), (0, h, 0)), quads([[-r, 0, r]], (2 * r, 0, 0), (0, h, 0)),
             quads([[-r, 0, -r]], (0, 0, 2 * r), (0, h, 0)), quads([[r, 0, -r]], (0, 0, 2 * r), (0, h, 0)),
             quads([[-r, 0, -r]], (2 * r, 0, 0), (0, 0, 2 * r)), quads([[-r, h, -r]], (2 * r, 0, 0), (0, 0, 2 * r))]
    positions = numpy.concatenate([p for p, _ in sides])
    triangles = numpy.concatenate([t + 4 * i for i, (_, t) in enumerate(sides)])
    return "walls", positions, triangles, 0


def hills(triangles, width, waves, seed):
    """A bumpy square around the origin."""
    n = max(2, round(math.sqrt(triangles / 2)))
    x, z = numpy.meshgrid(*[numpy.linspace(-0.5, 0.5, n + 1)] * 2, indexing="ij")
    phase = numpy.random.default_rng(seed).uniform(0, 6.28, 2)
    y = 0.03 * (1 + numpy.sin(6.28 * waves * x + phase[0]) * numpy.sin(6.28 * waves * z + phase[1]))
    at = (numpy.arange(n)[:, None] * (n + 1) + numpy.arange(n)[None, :]).reshape(-1, 1)
    faces = numpy.concatenate([at + [0, 1, n + 2], at + [0, n + 2, n + 1]], axis=1).reshape(-1, 3)
    return numpy.stack([width * x, width * y, width * z], axis=-1).reshape(-1, 3), faces


CAMERA = (0.0, 0.45 * ROOM, 0.95 * ROOM)


def panel():
    return ("panel", *quads([[-0.5, 0.74 * ROOM, -0.5]], (1, 0, 0), (0, 0, 1)), 1)


def different_triangles(path, count):
    glb(path, [walls(), panel(), ("hills", *hills(count, 1.8 * ROOM, 12, 1), 0)],
        [(0, (0, 0, 0)), (1, (0, 0, 0)), (2, (0, 0.2, 0))], CAMERA)


def instanced_triangles(path, count):
    each = 1000
    side = max(1, round(math.sqrt(count / each)))
    width = 1.8 * ROOM / side
    places = [(2, ((i + 0.5) * width - 0.9 * ROOM, 0.2, (k + 0.5) * width - 0.9 * ROOM))
              for i in range(side) for k in range(side)]
    glb(path, [walls(), panel(), ("tile", *hills(each, width, 2, 1), 0)],
        [(0, (0, 0, 0)), (1, (0, 0, 0)), *places], CAMERA)


def lamps(path, count):
    random = numpy.random.default_rng(3)
    corners = numpy.stack([random.uniform(-0.9 * ROOM, 0.9 * ROOM, count), numpy.full(count, 0.74 * ROOM),
                           random.uniform(-0.9 * ROOM, 0.9 * ROOM, count)], axis=1)
    side = 1.0 / math.sqrt(count)
    glb(path, [walls(), ("lamps", *quads(corners, (side, 0, 0), (0, 0, side)), 1)], [(0, (0, 0, 0)), (1, (0, 0, 0))],
        CAMERA)


def axes():
    """name -> (what grows, [(value, arguments)]); a scene to be made is (how, of how many)"""
    small = ["--size", "480x320", "--aa", "1"]
    atrium = ["demo:atrium", *small]
    return {
        "pixels": ("pixels, demo:atrium at 10 %", [
            (w * h, ["demo:atrium", "--size", f"{w}x{h}", "--aa", "1", "--target-error", "10%"])
            for w, h in ((250, 250), (500, 500), (1000, 1000), (1920, 1080), (3840, 2160), (7680, 4320))]),
        "triangles": ("triangles, all different", [
            (n, [(different_triangles, n), *small]) for n in (10**4, 10**5, 10**6, 10**7)]),
        "instances": ("triangles, a thousand and their instances", [
            (n, [(instanced_triangles, n), *small]) for n in (10**4, 10**5, 10**6, 10**7)]),
        "lamps": ("lamps that emit as much together", [
            (n, [(lamps, n), *small]) for n in (1, 10, 100, 1000, 10**4, 10**5)]),
        "bounces": ("bounces, demo:atrium", [(n, [*atrium, "--bounces", str(n)]) for n in (1, 2, 4, 8, 16)]),
        "passes": ("passes (--aa), demo:atrium", [
            (n, ["demo:atrium", "--size", "480x320", "--aa", str(n)]) for n in (1, 4, 16, 64)]),
        "records": ("records, demo:atrium, by --accuracy with --min-reach 1", [
            (a, [*atrium, "--accuracy", str(a), "--min-reach", "1", "--refinement", "1"])
            for a in (0.8, 0.4, 0.2, 0.1, 0.05)]),
        "threads": ("threads, demo:atrium", [
            (n, ["demo:atrium", "--size", "1000x1000", "--aa", "1", "--threads", str(n)])
            for n in range(1, (os.cpu_count() or 1) + 1)]),
    }


def scene_file(folder, scene):
    if isinstance(scene, str):
        return scene
    make, count = scene
    path = folder / f"{make.__name__}_{count}.glb"
    if not path.exists():
        make(path, count)
    return str(path)


def render(rcsplat, arguments, folder):
    """@return wall and processor seconds, peak memory [MB], statistics"""
    command = [rcsplat, "render", scene_file(folder, arguments[0]), *arguments[1:], "-o", str(folder / "picture.png"),
               "--json"]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"{' '.join(command)}\nfailed with {result.returncode}: {result.stderr.strip()}")
    stats = json.loads(result.stdout)
    return stats["seconds"], stats["cpu_seconds"], stats["peak_memory_bytes"] / 1e6, stats


def exponent(before, after):
    """Of (value, seconds) pairs."""
    return math.log(after[1] / before[1]) / math.log(after[0] / before[0])


def print_axis(rcsplat, name, title, rows, runs, folder):
    by_records = name == "records"
    print(f"| {title} | {'--accuracy | ' if by_records else ''}wall [s] | processor [s] | exponent | memory [MB] |")
    print("| --- " * (6 if by_records else 5) + "|")
    before = None
    for value, arguments in rows:
        found = [render(rcsplat, arguments, folder) for _ in range(runs)]
        wall, cpu, memory = (statistics.median(f[i] for f in found) for i in range(3))
        grown = found[0][3]["records"] if by_records else value
        here = (grown, wall if name == "threads" else cpu)
        shown = "" if before is None else f"{exponent(before, here):.2f}"
        own = f"{value} | " if by_records else ""
        print(f"| {grown:,} | {own}{wall:.2f} | {cpu:.2f} | {shown} | {memory:.0f} |", flush=True)
        before = here
    print()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder for scenes and pictures")
    parser.add_argument("--runs", type=int, default=3, help="of each setting, of which medians are shown")
    parser.add_argument("--only", nargs="+", help="axes to take")
    parser.add_argument("--largest", type=float, default=1.0, help="leave out rows above that part of the last value")
    args = parser.parse_args()
    if not shutil.which(args.rcsplat):
        parser.error(f"{args.rcsplat} is no program")
    args.output.mkdir(parents=True, exist_ok=True)
    known = axes()
    for name in args.only or known:
        if name not in known:
            parser.error(f"--only {name} is none of {', '.join(known)}")
    for name in args.only or known:
        title, rows = known[name]
        if name in ("pixels", "triangles", "instances", "lamps"):
            rows = [row for row in rows if row[0] <= args.largest * rows[-1][0]]
        print_axis(args.rcsplat, name, title, rows, args.runs, args.output)


if __name__ == "__main__":
    main()

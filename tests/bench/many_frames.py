#!/usr/bin/env python3
"""Renders a batch of many small frames, and says how memory and processor time go on from thousand to thousand.

    tests/bench/many_frames.py build/release/bin/rcsplat [--frames 10000] [--case still|moving] [--times 3]

A room with a lamp, seen by a camera on a path that begins anew every thousand frames: as it stands, and with a box in
it that moves to and fro likewise, so that each thousand has the same work. What the process takes to start, up to the
first frame, is told apart. With --times the medians of so many runs. Files are written to TMPDIR: one in memory keeps
out what file systems do while many files have just been removed. Ends with 1 where the memory that the process holds
(RSS) after each thousand is not within 5 % of its mean, or processor time per frame not within 10 %.
"""
import argparse
import base64
import json
import os
import pathlib
import statistics
import struct
import subprocess
import sys
import tempfile

FPS = 1000  # frames of a round, which is a second
BOX = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]  # seen from outside


class Scene:
    """A glTF file with its one buffer within."""

    def __init__(self):
        self.data = b""
        self.json = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], "meshes": [], "nodes": [],
                     "materials": [], "scene": 0}

    def numbers(self, rows, kind):
        view = b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(view)})
        self.data += view
        columns = list(zip(*rows))
        self.json["accessors"].append({"bufferView": len(self.json["bufferViews"]) - 1, "componentType": 5126,
                                       "count": len(rows), "type": kind, "min": [min(c) for c in columns],
                                       "max": [max(c) for c in columns]})
        return len(self.json["accessors"]) - 1

    def box(self, size, place, inward=False, light=0.0):
        """@return the number of its node"""
        points = []
        for side in SIDES:
            a, b, c, d = [[s * x for s, x in zip(size, BOX[i])] for i in (side[::-1] if inward else side)]
            points += [a, b, c, a, c, d]
        material = {"pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.6, 0.5, 1], "metallicFactor": 0}}
        if light > 0.0:
            material["emissiveFactor"] = [1, 1, 1]
            material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": light}}
        self.json["materials"].append(material)
        self.json["meshes"].append({"primitives": [{"attributes": {"POSITION": self.numbers(points, "VEC3")},
                                                    "material": len(self.json["materials"]) - 1}]})
        self.json["nodes"].append({"mesh": len(self.json["meshes"]) - 1, "translation": place})
        return len(self.json["nodes"]) - 1

    def move(self, node, times, places):
        self.json["animations"] = [{
            "samplers": [{"input": self.numbers([[t] for t in times], "SCALAR"),
                          "output": self.numbers(places, "VEC3")}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}]}]

    def write(self, path):
        self.json["scenes"] = [{"nodes": list(range(len(self.json["nodes"])))}]
        self.json["extensionsUsed"] = ["KHR_materials_emissive_strength"]
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        self.json["buffers"] = [{"byteLength": len(self.data), "uri": uri}]
        path.write_text(json.dumps(self.json))


def room(moves, rounds):
    scene = Scene()
    scene.box([6, 3, 6], [0, 1.5, 0], inward=True)
    scene.box([1, 0.1, 1], [0, 2.9, 0], light=10.0)
    box = scene.box([0.8, 0.8, 0.8], [1, 0.4, 0])
    if moves:
        times = [i / 4 for i in range(4 * rounds + 1)]
        scene.move(box, times, [[(1, 0, -1, 0)[i % 4], 0.4, (0, 1, 0, -1)[i % 4]] for i in range(len(times))])
    return scene


def camera_path(rounds):
    eyes = [[-2, 1.5, 2.5], [0, 1.2, 2], [2, 1.5, 2.5], [0, 1.8, 2]]
    keys = [{"frame": FPS * i // 4, "eye": eyes[i % 4], "target": [0, 1, 0]} for i in range(4 * rounds + 1)]
    return {"fps": FPS, "keys": keys}


def held(process):
    """@return memory that it holds [MB], processor time it has taken [s]"""
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
    memory = int(status.split("VmRSS:")[1].split()[0]) / 1000
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return memory, (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run(rcsplat, moves, frames, folder):
    rounds = frames // FPS
    room(moves, rounds + 1).write(folder / "room.gltf")
    (folder / "path.json").write_text(json.dumps(camera_path(rounds + 1)))
    words = [rcsplat, "batch", folder / "room.gltf", "--camera-path", folder / "path.json", "--frames", f"1-{frames}",
             "--fps", FPS, "--size", "16x16", "--aa", "1", "--no-movie", "-o", folder / "f.#####.png"]
    rows, before, done = [], 0.0, 0
    with subprocess.Popen([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          text=True) as process:
        for line in process.stdout:
            if not line.startswith("frame "):
                continue
            number = int(line.split()[1].rstrip(":"))
            if " rendered in " not in line:
                sys.exit(line)
            if number == 1:
                _, before = held(process)
                done = 1
                print(f"     1 frame, and to start: {1e3 * before:.0f} ms of processor time", flush=True)
            if number % FPS == 0:
                memory, seconds = held(process)
                rows.append((memory, 1e3 * (seconds - before) / (number - done)))
                print(f"{number:6} frames: {rows[-1][0]:7.1f} MB, {rows[-1][1]:6.2f} ms of processor time a frame",
                      flush=True)
                before, done = seconds, number
    if process.returncode not in (0, 80):
        sys.exit(f"the batch ended with {process.returncode}")
    return rows


def spread(values):
    """The most that one of them is off their mean."""
    mean = statistics.mean(values)
    return max(abs(value - mean) for value in values) / mean


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=10 * FPS, help="a multiple of %d" % FPS)
    parser.add_argument("--times", type=int, default=1, help="runs, of which each thousand's median is told")
    parser.add_argument("--case", choices=["still", "moving"])
    arguments = parser.parse_args()
    if arguments.frames < FPS or arguments.frames % FPS:
        parser.error(f"--frames: {arguments.frames}, expected a multiple of {FPS}")
    failed = False
    for case in ["still", "moving"]:
        if arguments.case not in (None, case):
            continue
        print(f"{case}:", flush=True)
        runs = []
        for _ in range(arguments.times):
            with tempfile.TemporaryDirectory() as folder:
                runs.append(run(arguments.rcsplat.resolve(), case == "moving", arguments.frames, pathlib.Path(folder)))
        memory, times = ([statistics.median(row[k] for row in thousand) for thousand in zip(*runs)] for k in (0, 1))
        print(f"medians of {arguments.times}: {min(memory):.1f} to {max(memory):.1f} MB, {min(times):.2f} to "
              f"{max(times):.2f} ms")
        memory, seconds = spread(memory), spread(times)
        failed = failed or memory > 0.05 or seconds > 0.10
        print(f"memory within {100 * memory:.1f} % of its mean (5), time per frame within {100 * seconds:.1f} % (10)")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""What the effect plan is worth: processor time of `--effects auto` against `--effects all`, in pairs.

    tests/bench/effects_gain.py build/release/bin/rcsplat [--pairs 3] [--size 320x320] [SCENE[@CAMERA] ...]

Each pair renders both ways one after the other, in turn first; the ratio all / auto of each pair is printed, and their
median. Only the processor time of rendering counts: that of loading the scene and starting OpenGL is measured by
rendering a single pixel of it and taken off. Scenes written by this script (room, emissive, unlit) call for little.
"""
import argparse
import json
import os
import resource
import statistics
import struct
import subprocess
import sys
import tempfile


def box_room(material, lights):
    """A glTF room of 4 x 3 x 4 m seen from inside, all of one material."""
    corners = [(x, y, z) for x in (-2.0, 2.0) for y in (0.0, 3.0) for z in (-2.0, 2.0)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    positions, indices = [], []
    for face in faces:
        first = len(positions)
        positions += [corners[i] for i in face]
        indices += [first, first + 1, first + 2, first, first + 2, first + 3]
    data = b"".join(struct.pack("<3f", *p) for p in positions) + struct.pack(f"<{len(indices)}H", *indices)
    split = 12 * len(positions)
    node = {"children": [1, 2] if lights else [1], "mesh": 0}
    nodes = [node, {"camera": 0, "translation": [0, 1.5, 1.8]}]
    gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes,
            "cameras": [{"type": "perspective", "name": "camera", "perspective": {"yfov": 0.9, "znear": 0.01}}],
            "materials": [dict(material, doubleSided=True)],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
            "buffers": [{"byteLength": len(data), "uri": "room.bin"}],
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": split},
                            {"buffer": 0, "byteOffset": split, "byteLength": len(data) - split}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3",
                           "min": [-2, 0, -2], "max": [2, 3, 2]},
                          {"bufferView": 1, "componentType": 5123, "count": len(indices), "type": "SCALAR"}]}
    used = []
    if lights:
        nodes.append({"translation": [1, 2.5, 0.5], "extensions": {"KHR_lights_punctual": {"light": 0}}})
        gltf["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 3.0}]}}
        used.append("KHR_lights_punctual")
    used += list(material.get("extensions", {}))
    if used:
        gltf["extensionsUsed"] = used
    return json.dumps(gltf), data


# KHR_materials_specular 0 makes glTF's standard dielectric a Lambertian surface.
LAMBERTIAN = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0},
              "extensions": {"KHR_materials_specular": {"specularFactor": 0}}}
LITTLE = {
    "room": (LAMBERTIAN, True),
    "emissive": ({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
                  "emissiveFactor": [1, 1, 1],
                  "extensions": {"KHR_materials_specular": {"specularFactor": 0}}}, False),
    "unlit": ({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]},
               "extensions": {"KHR_materials_unlit": {}}}, True),
}


def processor_seconds(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("scenes", nargs="*",
                        default=["room", "emissive", "unlit", "demo:cornell", "demo:spheres", "demo:furnace",
                                 "demo:closed-box", "demo:sphere-light", "demo:corner", "demo:atrium"])
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--size", default="320x320")
    parser.add_argument("--options", default="", help="more of render's options, in one string")
    arguments = parser.parse_args()
    print(f"{'scene':28} {'auto [s]':>9} {'all [s]':>9} {'all/auto':>9}   pairs")
    with tempfile.TemporaryDirectory() as folder:
        for scene in arguments.scenes:
            name, _, camera = scene.partition("@")
            path = name
            if name in LITTLE:
                text, data = box_room(*LITTLE[name])
                path = os.path.join(folder, "room.gltf")
                with open(path, "w") as file:
                    file.write(text)
                with open(os.path.join(folder, "room.bin"), "wb") as file:
                    file.write(data)
            base = [arguments.rcsplat, "render", path, "--quiet", "-o",
                    os.path.join(folder, "out.png")] + arguments.options.split()
            if camera:
                base += ["--camera", camera]

            def seconds(effects, size):
                return processor_seconds(base + ["--size", size, "--effects", effects])

            start = {e: min(seconds(e, "1x1") for _ in range(2)) for e in ("auto", "all")}
            times = {"auto": [], "all": []}
            for pair in range(arguments.pairs):
                for effects in ("auto", "all") if pair % 2 == 0 else ("all", "auto"):
                    times[effects].append(max(1e-3, seconds(effects, arguments.size) - start[effects]))
            ratios = [b / a for a, b in zip(times["auto"], times["all"])]
            print(f"{os.path.basename(scene):28} {statistics.median(times['auto']):9.2f} "
                  f"{statistics.median(times['all']):9.2f} {statistics.median(ratios):9.2f}   "
                  f"{' '.join(f'{r:.2f}' for r in ratios)}", flush=True)


if __name__ == "__main__":
    sys.exit(main())

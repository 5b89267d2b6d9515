#!/usr/bin/env python3
"""Rooms that nobody tuned for: draws them at random, renders them, and compares error and estimate with references.
Prints the table as Markdown. A room depends on its number alone: its size, colours, metal and lacquer of any roughness,
boxes and balls, and how it is lit: a panel close to the ceiling, small lamps, point lamps, a sun or a bright wall
behind a window, or a lamp in the next room behind a gap. References are kept and made only when missing.

The errors are calibration.py's: the references' noise is taken off in squares. Mean: of the picture over the reference.

Needs `pip install numpy scipy OpenEXR`.

    tests/bench/random_rooms.py build/release/bin/rcsplat -o /tmp/rooms --rooms 1-8 > table.md
    tests/bench/random_rooms.py ... --settings '' '--target-error indirect=5%' --bounces 3
"""
import argparse
import array
import json
import math
import pathlib
import random
import struct

import calibration

LAMBERTIAN = {"KHR_materials_specular": {"specularFactor": 0}}


def material(color, metal=0.0, roughness=1.0, emission=0.0, matt=False):
    made = {"pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0], "metallicFactor": metal,
                                     "roughnessFactor": roughness}}
    if emission:
        made["emissiveFactor"] = [1.0, 0.95, 0.85]
        made["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": emission}}
    if matt:
        made["extensions"] = LAMBERTIAN
    return made


class Room:
    """Triangles by material, lamps without extent, a camera; as a glTF file."""

    def __init__(self):
        self.parts, self.lamps, self.camera = [], [], None

    def add(self, look, positions, normals, indices):
        self.parts.append((look, positions, normals, indices))

    def quad(self, look, corner, u, v):
        """Seen from where u, v turn counterclockwise."""
        normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        length = math.hypot(*normal)
        corners = [corner, [a + b for a, b in zip(corner, u)], [a + b + c for a, b, c in zip(corner, u, v)],
                   [a + b for a, b in zip(corner, v)]]
        self.add(look, corners, [[a / length for a in normal]] * 4, [0, 1, 2, 0, 2, 3])

    def box(self, look, centre, half, turn=0.0):
        c, s = math.cos(turn), math.sin(turn)
        axes = [(c * half[0], 0, s * half[0]), (0, half[1], 0), (-s * half[2], 0, c * half[2])]
        for i in range(3):
            for sign in (1, -1):
                u, v = axes[(i + 1) % 3], axes[(i + 2) % 3]
                if sign < 0:
                    u, v = v, u
                corner = [centre[k] + sign * axes[i][k] - u[k] - v[k] for k in range(3)]
                self.quad(look, corner, [2 * a for a in u], [2 * a for a in v])

    def ball(self, look, centre, radius, rows=24):
        columns = 2 * rows
        normals = [(math.sin(math.pi * i / rows) * math.cos(2 * math.pi * j / columns), math.cos(math.pi * i / rows),
                    math.sin(math.pi * i / rows) * math.sin(2 * math.pi * j / columns))
                   for i in range(rows + 1) for j in range(columns + 1)]
        at = [(i * (columns + 1) + j, (i + 1) * (columns + 1) + j) for i in range(rows) for j in range(columns)]
        indices = [k for a, b in at for k in (a, a + 1, b, a + 1, b + 1, b)]
        self.add(look, [[c + radius * n for c, n in zip(centre, normal)] for normal in normals], normals, indices)

    def write(self, path):
        data, views, accessors, primitives, materials = b"", [], [], [], []

        def accessor(code, rows, kind, **bounds):
            nonlocal data
            packed = array.array(code, rows).tobytes()
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
            data += packed
            accessors.append({"bufferView": len(views) - 1, "componentType": 5126 if code == "f" else 5125,
                              "count": len(rows) // (3 if kind == "VEC3" else 1), "type": kind, **bounds})
            return len(accessors) - 1

        for look, positions, normals, indices in self.parts:
            if look not in materials:
                materials.append(look)
            bounds = {"min": [min(p[k] for p in positions) for k in range(3)],
                      "max": [max(p[k] for p in positions) for k in range(3)]}
            primitives.append({"attributes": {
                "POSITION": accessor("f", [x for p in positions for x in p], "VEC3", **bounds),
                "NORMAL": accessor("f", [x for n in normals for x in n], "VEC3")},
                "indices": accessor("I", indices, "SCALAR"), "material": materials.index(look)})
        eye, target = self.camera
        nodes = [{"mesh": 0}, {"camera": 0, "translation": list(eye), "rotation": looking(eye, target)}]
        for i, (at, turn, _) in enumerate(self.lamps):
            nodes.append({"translation": list(at), "rotation": turn,
                          "extensions": {"KHR_lights_punctual": {"light": i}}})
        gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}],
                "nodes": nodes, "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.01}}],
                "materials": materials, "meshes": [{"primitives": primitives}], "accessors": accessors,
                "bufferViews": views, "buffers": [{"byteLength": len(data)}],
                "extensionsUsed": ["KHR_materials_specular", "KHR_materials_emissive_strength", "KHR_lights_punctual"]}
        if self.lamps:
            gltf["extensions"] = {"KHR_lights_punctual": {"lights": [lamp for _, _, lamp in self.lamps]}}
        text = json.dumps(gltf).encode()
        text += b" " * (-len(text) % 4)
        path.write_bytes(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(data)) +
                         struct.pack("<II", len(text), 0x4E4F534A) + text +
                         struct.pack("<II", len(data), 0x004E4942) + data)


def looking(eye, target):
    """The quaternion that turns -z from the eye to the target and leaves x level."""
    d = [b - a for a, b in zip(eye, target)]
    yaw, pitch = math.atan2(-d[0], -d[2]), math.atan2(d[1], math.hypot(d[0], d[2]))
    y, p = (math.sin(yaw / 2), math.cos(yaw / 2)), (math.sin(pitch / 2), math.cos(pitch / 2))
    return [y[1] * p[0], y[0] * p[1], -y[0] * p[0], y[1] * p[1]]


def draw_look(draw, metal):
    color = [round(draw.uniform(0.25, 0.85), 3) for _ in range(3)]
    kind = draw.random()
    if kind < metal:
        return material([0.5 + c / 2 for c in color], 1.0, draw.uniform(0.1, 0.7))
    if kind < 0.5 + 0.5 * metal:
        return material(color, 0.0, draw.uniform(0.15, 0.6))
    return material(color, matt=True)


def close_walls(room, look, size, opening):
    """Six walls that look inwards; that at x = 0 with an opening where one is wanted: (z, y, width, height)."""
    w, h, d = size
    looks = [look() for _ in range(6)]
    room.quad(looks[0], (0, 0, 0), (0, 0, d), (w, 0, 0))
    room.quad(looks[1], (0, h, 0), (w, 0, 0), (0, 0, d))
    room.quad(looks[2], (0, 0, 0), (w, 0, 0), (0, h, 0))
    room.quad(looks[3], (w, 0, d), (-w, 0, 0), (0, h, 0))
    room.quad(looks[4], (w, 0, 0), (0, 0, d), (0, h, 0))
    z, y, width, height = opening or (0, 0, 0, 0)
    spans = [(0, z, 0, h), (z + width, d, 0, h), (z, z + width, 0, y), (z, z + width, y + height, h)]
    for z0, z1, y0, y1 in spans:
        if z1 > z0 and y1 > y0:
            room.box(looks[5], (-0.1, (y0 + y1) / 2, (z0 + z1) / 2), (0.1, (y1 - y0) / 2, (z1 - z0) / 2))


def light_by_window(room, draw, size):
    """A bright wall outside, or a sun."""
    _, h, d = size
    z, y = draw.uniform(0.2, 0.5) * d, 0.3 * h
    opening = (z, y, 0.35 * d, 0.5 * h)
    if draw.random() < 0.5:
        room.quad(material((0, 0, 0), emission=draw.uniform(5, 20), matt=True), (-3, -2, d + 3), (0, 0, -d - 6),
                  (0, h + 5, 0))
    else:
        towards = (1.0, -draw.uniform(0.4, 1.0), draw.uniform(-0.4, 0.4))
        room.lamps.append(((0, 0, 0), looking((0, 0, 0), towards), {"type": "directional", "intensity": 20.0}))
    return opening


def light_by_gap(room, draw, size):
    """A lit chamber next door, and a gap as of a door that is ajar."""
    _, h, d = size
    opening = (draw.uniform(0.2, 0.7) * d, 0.0, draw.uniform(0.1, 0.4), 0.8 * h)
    plain = material((0.7, 0.7, 0.7), matt=True)
    room.quad(plain, (-3, 0, 0), (0, 0, d), (2.8, 0, 0))
    room.quad(plain, (-3, h, 0), (2.8, 0, 0), (0, 0, d))
    room.quad(plain, (-3, 0, 0), (2.8, 0, 0), (0, h, 0))
    room.quad(plain, (-0.2, 0, d), (-2.8, 0, 0), (0, h, 0))
    room.quad(plain, (-3, 0, d), (0, 0, -d), (0, h, 0))
    room.quad(material((0, 0, 0), emission=60, matt=True), (-2.2, h - 0.1, 0.3 * d), (0.8, 0, 0), (0, 0, 0.8))
    return opening


def light_inside(room, draw, size):
    w, h, d = size
    kind = draw.randrange(3)
    if kind == 0:
        a, below = draw.uniform(0.2, 1.2), draw.choice([0.002, 0.01, 0.05, 0.3])
        room.quad(material((0, 0, 0), emission=12 / a**2, matt=True),
                  (draw.uniform(0.2, 0.5) * w, h - below, draw.uniform(0.2, 0.5) * d), (a, 0, 0), (0, 0, a))
    for _ in range(draw.randint(1, 8) if kind else 0):
        at = [draw.uniform(0.2, 0.8) * w, draw.uniform(0.75, 0.95) * h, draw.uniform(0.2, 0.8) * d]
        radius = draw.uniform(0.01, 0.08)
        if kind == 1:
            room.ball(material((0, 0, 0), emission=1.5 / radius**2, matt=True), at, radius, 8)
        else:
            room.lamps.append((at, [0, 0, 0, 1], {"type": "point", "intensity": draw.uniform(2, 8)}))


def draw_room(number, metal):
    draw = random.Random(number)

    def look():
        return draw_look(draw, metal)

    room = Room()
    size = w, h, d = draw.uniform(3, 8), draw.uniform(2.4, 4), draw.uniform(3, 8)
    light = draw.choice([light_by_window, light_by_gap, light_inside, light_inside])
    close_walls(room, look, size, light(room, draw, size))
    for _ in range(draw.randint(2, 7)):
        at, half = (draw.uniform(0.15, 0.85) * w, draw.uniform(0.1, 0.65) * d), draw.uniform(0.15, 0.5)
        if draw.random() < 0.4:
            room.ball(look(), (at[0], half, at[1]), half)
        else:
            tall = draw.uniform(0.1, 0.35) * h
            room.box(look(), (at[0], tall, at[1]), (half, tall, draw.uniform(0.15, 0.5)),
                     draw.uniform(0, math.pi))
    room.camera = ((0.85 * w, 0.55 * h, 0.95 * d), (draw.uniform(0.1, 0.4) * w, 0.35 * h, 0.1 * d))
    return room


def numbers(text):
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def compare_room(args, number):
    stem = f"room{number}_{args.metal:g}"
    scene = args.output / f"{stem}.glb"
    draw_room(number, args.metal).write(scene)
    common = [scene, "--size", f"{args.size}x{args.size}", "--aa", "1", "--bounces", args.bounces]
    both = calibration.references(args, f"{stem}_{args.bounces}", common, args.paths)
    for settings in args.settings:
        row = calibration.measure(args, common, settings, *both)
        print(f"| {number} | `{settings}` | {row['mre']:.1%} | {row['noise']:.1%} | {row['mean']:.3f} | "
              f"{row['estimate']:.1%} | {row['estimate'] / row['mre']:.2f} | {row['cpu']:.1f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder for rooms and references")
    parser.add_argument("--rooms", type=numbers, default=range(1, 9), metavar="FIRST-LAST")
    parser.add_argument("--metal", type=float, default=0.25, help="of the surfaces, in [0, 1]")
    parser.add_argument("--size", type=int, default=400, help="width and height [px]")
    parser.add_argument("--stride", type=int, default=4,
                        help="references have every so-manyth pixel of each row and column")
    parser.add_argument("--paths", type=int, default=4096, help="a pixel, of each of two references")
    parser.add_argument("--bounces", type=int, default=1)
    parser.add_argument("--settings", nargs="+", default=[""], help="options of rcsplat render, as one word each")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    print(f"{args.size} x {args.size}, --aa 1 --bounces {args.bounces}\n")
    print("| room | settings | measured MRE | of it reference noise | mean | estimated | ratio | CPU [s] |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for number in args.rooms:
        compare_room(args, number)


if __name__ == "__main__":
    main()

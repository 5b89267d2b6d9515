"""Reads and writes binary glTF files with one buffer, as far as the comparisons with other renderers need them:
triangles in world space, base colours, emission, punctual lights, perspective cameras."""

import dataclasses
import json
import pathlib
import struct
import sys

import numpy as np

COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Glb:
    """A .glb file: `json` is its document, `buffer` the bytes of its one buffer."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        if len(data) < 28 or data[:4] != b"glTF":
            sys.exit(f"{path}: not a binary glTF file")
        length = struct.unpack_from("<I", data, 12)[0]
        self.json = json.loads(data[20:20 + length])
        self.buffer = data[28 + length:]
        lacking = set(self.json.get("extensionsRequired", []))
        if lacking:
            sys.exit(f"{path}: requires {', '.join(sorted(lacking))}, which this converter does not read")

    def __getitem__(self, name):
        return self.json.get(name, [])

    def view(self, index):
        """The bytes of a buffer view, and its stride or None."""
        view = self["bufferViews"][index]
        start = view.get("byteOffset", 0)
        return self.buffer[start:start + view["byteLength"]], view.get("byteStride")

    def accessor(self, index):
        """Array (count, components)."""
        a = self["accessors"][index]
        data, stride = self.view(a["bufferView"])
        dtype, width = np.dtype(COMPONENTS[a["componentType"]]), WIDTHS[a["type"]]
        stride = stride or dtype.itemsize * width
        values = np.ndarray((a["count"], width), dtype, data, a.get("byteOffset", 0), (stride, dtype.itemsize))
        if a.get("normalized"):
            return values.astype(np.float64) / np.iinfo(dtype).max
        return np.array(values)


def write_glb(path, document, buffer):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    buffer += b"\0" * (-len(buffer) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(buffer)))
        file.write(struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(buffer), 0x4E4942) +
                   buffer)


def node_matrix(node):
    """parent_from_node, 4 x 4."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    m = np.eye(4)
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    m[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    m[:3, :3] = m[:3, :3] * np.array(node.get("scale", (1, 1, 1)))
    m[:3, 3] = node.get("translation", (0, 0, 0))
    return m


def all_nodes(glb):
    """(node, world_from_node) of the default scene, in the order of the file."""
    stack = [(i, np.eye(4)) for i in reversed(glb["scenes"][glb.json.get("scene", 0)]["nodes"])]
    while stack:
        index, parent = stack.pop()
        node = glb["nodes"][index]
        world = parent @ node_matrix(node)
        stack += [(child, world) for child in reversed(node.get("children", []))]
        yield node, world


@dataclasses.dataclass
class Mesh:
    positions: np.ndarray  # (vertices, 3), world space [m]
    normals: np.ndarray | None  # (vertices, 3), unit; None where all are those of the flat triangles
    uvs: np.ndarray | None  # (vertices, 2)
    triangles: np.ndarray  # (triangles, 3), counter-clockwise seen from the front
    material: int | None


@dataclasses.dataclass
class Light:
    kind: str  # directional, point, spot
    color: np.ndarray  # times intensity [lx or cd]
    position: np.ndarray  # [m]
    axis: np.ndarray  # unit, the way the light goes
    inner: float  # half angles of a spot [rad]
    outer: float


@dataclasses.dataclass
class Camera:
    name: str
    world: np.ndarray  # world_from_camera, 4 x 4; it looks along -z, x to the right
    yfov: float  # [rad]

    eye = property(lambda self: self.world[:3, 3])
    forward = property(lambda self: -self.world[:3, 2] / np.linalg.norm(self.world[:3, 2]))
    up = property(lambda self: self.world[:3, 1] / np.linalg.norm(self.world[:3, 1]))
    right = property(lambda self: self.world[:3, 0] / np.linalg.norm(self.world[:3, 0]))


def read_mesh(glb, primitive, world):
    a = primitive["attributes"]
    if primitive.get("mode", 4) != 4 or "COLOR_0" in a:
        sys.exit("only triangles without vertex colours are read")
    positions = glb.accessor(a["POSITION"]) @ world[:3, :3].T + world[:3, 3]
    triangles = (glb.accessor(primitive["indices"]).reshape(-1, 3) if "indices" in primitive
                 else np.arange(len(positions)).reshape(-1, 3)).astype(np.int64)
    mirrored = np.linalg.det(world[:3, :3]) < 0
    if mirrored:
        triangles = triangles[:, [0, 2, 1]]  # fronts stay fronts
    normals = None
    if "NORMAL" in a:
        normals = glb.accessor(a["NORMAL"]) @ np.linalg.inv(world[:3, :3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        if np.all(np.abs(normals[triangles] - face_normals(positions, triangles)[:, None]).max(axis=(1, 2)) < 1e-4):
            normals = None
    uvs = glb.accessor(a["TEXCOORD_0"]) if "TEXCOORD_0" in a else None
    return Mesh(positions, normals, uvs, triangles, primitive.get("material"))


def face_normals(positions, triangles):
    corner = positions[triangles]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def read_light(light, world):
    if "range" in light:
        sys.exit("lights with a range are not read")
    spot = light.get("spot", {})
    return Light(light["type"], np.array(light.get("color", (1, 1, 1))) * light.get("intensity", 1.0), world[:3, 3],
                 -world[:3, 2] / np.linalg.norm(world[:3, 2]), float(spot.get("innerConeAngle", 0.0)),
                 float(spot.get("outerConeAngle", np.pi / 4)))


def emission(material):
    """Radiance of a glTF material."""
    strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    return np.array(material.get("emissiveFactor", (0, 0, 0))) * strength


def material_of(glb, mesh):
    return glb["materials"][mesh.material] if mesh.material is not None else {}


def base_color(material):
    return np.array(material.get("pbrMetallicRoughness", {}).get("baseColorFactor", (1, 1, 1, 1))[:3], float)


def scene_of(glb):
    """(meshes, lights, cameras) in world space."""
    meshes, lights, cameras = [], [], []
    punctual = glb.json.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    for node, world in all_nodes(glb):
        if "mesh" in node:
            meshes += [read_mesh(glb, primitive, world) for primitive in glb["meshes"][node["mesh"]]["primitives"]]
        if "KHR_lights_punctual" in node.get("extensions", {}):
            lights.append(read_light(punctual[node["extensions"]["KHR_lights_punctual"]["light"]], world))
        if "camera" in node:
            c = glb["cameras"][node["camera"]]
            cameras.append(Camera(node.get("name", c.get("name", "")), world, float(c["perspective"]["yfov"])))
    return meshes, lights, cameras


def find_camera(cameras, name, path):
    """The camera of that name, or the first in the file where `name` is empty."""
    for camera in cameras:
        if name in ("", camera.name):
            return camera
    sys.exit(f"{path}: no camera '{name}', it has {', '.join(c.name for c in cameras) or 'none'}")

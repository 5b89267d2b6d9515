"""Blender's lamps as nodes of a glTF document: by KHR_lights_punctual, those with area as meshes."""

from __future__ import annotations

import math
import struct
from typing import Any, Dict, Iterator, List, Tuple

import bpy

from . import units
from .axes import columns, up_rows

OLD = bpy.app.version < (4, 0)

Triangles = List[Tuple[int, int, int]]
Points = List[Tuple[float, float, float]]

DISK_CORNERS = 48
SPHERE_STEPS = 3


def _node_factor(lamp: Any, warnings: List[str]) -> Tuple[float, float, float]:
    """What the lamp's own nodes multiply it by."""
    if not lamp.use_nodes or lamp.node_tree is None:
        return (1.0, 1.0, 1.0)
    for output in lamp.node_tree.nodes:
        if output.bl_idname == "ShaderNodeOutputLight" and output.is_active_output:
            links = output.inputs["Surface"].links
            node = links[0].from_node if links else None
            if node is None or node.bl_idname != "ShaderNodeEmission":
                break
            color, strength = node.inputs["Color"], node.inputs["Strength"]
            if color.is_linked or strength.is_linked:
                warnings.append(f"lamp '{lamp.name}': of its nodes the unlinked values are taken")
            scale = 1.0 if strength.is_linked else float(strength.default_value)
            red, green, blue = (1.0,) * 3 if color.is_linked else tuple(color.default_value)[:3]
            return (scale * red, scale * green, scale * blue)
    warnings.append(f"lamp '{lamp.name}': its nodes are no emission, and left out")
    return (1.0, 1.0, 1.0)


def _color(lamp: Any, warnings: List[str]) -> List[float]:
    tint = _node_factor(lamp, warnings)
    color = [float(lamp.color[i]) * tint[i] for i in range(3)]
    if getattr(lamp, "use_temperature", False):
        color = [color[i] * float(lamp.temperature_color[i]) for i in range(3)]
    scale = 2.0 ** float(getattr(lamp, "exposure", 0.0))
    return [scale * value for value in color]


def _watts(lamp: Any, matrix: Any) -> float:
    energy = float(lamp.energy)
    return energy if getattr(lamp, "normalize", True) else energy * float(lamp.area(matrix_world=matrix))


def _unit(matrix: Any) -> List[List[float]]:
    """A lamp's turn and place: Blender's lamps shine along -Z, as glTF's do."""
    rows = up_rows(matrix)
    lengths = [math.sqrt(sum(rows[i][j] ** 2 for i in range(3))) or 1.0 for j in range(3)]
    return [[rows[i][j] / lengths[j] for j in range(3)] + [rows[i][3]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def sphere(radius: float) -> Tuple[Points, Triangles]:
    """An icosahedron's faces in 9 parts each: from any side as bright as another to 0.3 %."""
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    ends: Points = []
    for a in (-1.0, 1.0):
        for b in (-golden, golden):
            ends += [(0.0, a, b), (a, b, 0.0), (b, 0.0, a)]
    near = [{j for j in range(12) if j != i and sum((ends[i][k] - ends[j][k]) ** 2 for k in range(3)) < 4.1}
            for i in range(12)]
    faces = [(i, j, k) for i in range(12) for j in near[i] if j > i for k in near[i] & near[j] if k > j]
    points: Points = []
    triangles: Triangles = []
    for face in faces:
        begin = len(points)
        for i in range(SPHERE_STEPS + 1):
            for j in range(SPHERE_STEPS + 1 - i):
                weights = (SPHERE_STEPS - i - j, i, j)
                mean = [sum(w * ends[c][k] for w, c in zip(weights, face)) for k in range(3)]
                points.append(_on_sphere(radius, mean))

        def number(i: int, j: int, begin: int = begin) -> int:
            return begin + i * (SPHERE_STEPS + 1) - i * (i - 1) // 2 + j

        for i in range(SPHERE_STEPS):
            for j in range(SPHERE_STEPS - i):
                triangles.append((number(i, j), number(i + 1, j), number(i, j + 1)))
                if i + j < SPHERE_STEPS - 1:
                    triangles.append((number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)))
    return points, [_outwards(points, t) for t in triangles]


def _on_sphere(radius: float, p: List[float]) -> Tuple[float, float, float]:
    length = math.sqrt(sum(x * x for x in p))
    return (radius * p[0] / length, radius * p[1] / length, radius * p[2] / length)


def _cross(points: Points, triangle: Tuple[int, int, int]) -> Tuple[float, float, float]:
    a, b, c = (points[i] for i in triangle)
    u, v = [b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)]
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def _outwards(points: Points, triangle: Tuple[int, int, int]) -> Tuple[int, int, int]:
    normal, a = _cross(points, triangle), points[triangle[0]]
    return triangle if sum(normal[i] * a[i] for i in range(3)) > 0.0 else (triangle[0], triangle[2], triangle[1])


def surface(points: Points, triangles: Triangles) -> float:
    return sum(0.5 * math.sqrt(sum(x * x for x in _cross(points, t))) for t in triangles)


def flat(shape: str, width: float, height: float) -> Tuple[Points, Triangles]:
    """Across -Z, which its front looks along."""
    if shape in ("DISK", "ELLIPSE"):
        turn = [2.0 * math.pi * i / DISK_CORNERS for i in range(DISK_CORNERS)]
        points = [(0.5 * width * math.cos(t), 0.5 * height * math.sin(t), 0.0) for t in turn]
    else:
        points = [(0.5 * width * x, 0.5 * height * y, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return points, [(0, i + 1, i) for i in range(1, len(points) - 1)]


class Lamps:
    """Adds lamps to a document, and their triangles to a buffer of its own."""

    def __init__(self, document: Dict[str, Any], soft: bool) -> None:
        self.document, self.soft = document, soft
        self.data = bytearray()
        self.warnings: List[str] = []
        self._views: List[Dict[str, Any]] = []

    def add(self, name: str, lamp: Any, matrix: Any) -> None:
        color = _color(lamp, self.warnings)
        if not max(color) > 0.0 or not lamp.energy > 0.0:
            return
        if lamp.type == "AREA":
            self._add_area(name, lamp, matrix, color)
        elif lamp.type == "POINT" and self.soft and lamp.shadow_soft_size > 0.0:
            points, triangles = sphere(lamp.shadow_soft_size)
            radiance = units.sphere_radiance(_watts(lamp, matrix), surface(points, triangles))
            self._add_mesh(name, (points, triangles), [radiance * c for c in color], _unit(matrix))
        else:
            self._add_punctual(name, lamp, matrix, color)

    def finish(self, uri: str) -> None:
        """Once the triangles lie in that file."""
        if not self.data:
            return
        buffers = self.document.setdefault("buffers", [])
        for view in self._views:
            view["buffer"] = len(buffers)
        buffers.append({"uri": uri, "byteLength": len(self.data)})

    def _add_punctual(self, name: str, lamp: Any, matrix: Any, color: List[float]) -> None:
        strongest = max(color)
        base: Dict[str, Any] = {"name": name, "color": [c / strongest for c in color]}
        watts = _watts(lamp, matrix) * strongest
        if lamp.type == "SUN":
            if lamp.angle > math.radians(1.0):
                turn = math.degrees(lamp.angle)
                self.warnings.append(f"sun '{name}': its angle of {turn:.3g} degrees is taken for 0")
            self._add_light(name, {**base, "type": "directional", "intensity": watts}, matrix)
            return
        full = units.point_intensity(watts)
        if lamp.type != "SPOT":
            self._add_light(name, {**base, "type": "point", "intensity": full}, matrix)
            return
        for share, inner, outer in units.spot_cones(lamp.spot_size, lamp.spot_blend, OLD):
            cone = {"innerConeAngle": inner, "outerConeAngle": min(outer, 0.5 * math.pi)}
            self._add_light(name, {**base, "type": "spot", "intensity": share * full, "spot": cone}, matrix)

    def _add_area(self, name: str, lamp: Any, matrix: Any, color: List[float]) -> None:
        height = lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size
        scale = [math.sqrt(sum(matrix[i][j] ** 2 for i in range(3))) for j in range(2)]
        points, triangles = flat(lamp.shape, lamp.size * scale[0], height * scale[1])
        if not surface(points, triangles) > 0.0:
            self.warnings.append(f"lamp '{name}' has no area, and is left out")
            return
        if getattr(lamp, "spread", math.pi) < math.pi - 1e-3:
            self.warnings.append(f"lamp '{name}': it shines everywhere in front of it; its spread is left out")
        radiance = units.area_radiance(_watts(lamp, matrix), surface(points, triangles), OLD)
        self._add_mesh(name, (points, triangles), [radiance * c for c in color], _unit(matrix))

    def _add_light(self, name: str, light: Dict[str, Any], matrix: Any) -> None:
        extension = self.document.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})
        extension["lights"].append(light)
        self._use("KHR_lights_punctual")
        number = len(extension["lights"]) - 1
        self._add_node({"name": name, "matrix": columns(_unit(matrix)),
                        "extensions": {"KHR_lights_punctual": {"light": number}}})

    def _add_mesh(self, name: str, shape: Tuple[Points, Triangles], radiance: List[float], rows: Any) -> None:
        points, triangles = shape
        strongest = max(radiance)
        material = {
            "name": f"lamp {name}", "emissiveFactor": [r / strongest for r in radiance],
            "pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0},
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strongest},
                           "KHR_materials_specular": {"specularFactor": 0.0}},
        }
        self._use("KHR_materials_emissive_strength")
        self._use("KHR_materials_specular")
        places = b"".join(struct.pack("<3f", *p) for p in points)
        corners = b"".join(struct.pack("<3I", *t) for t in triangles)
        bounds = {"min": [min(p[i] for p in points) for i in range(3)], "max": [max(p[i] for p in points)
                                                                               for i in range(3)]}
        position = self._add_accessor(places, {"componentType": 5126, "type": "VEC3", "count": len(points), **bounds})
        index = self._add_accessor(corners, {"componentType": 5125, "type": "SCALAR", "count": 3 * len(triangles)})
        primitive = {"attributes": {"POSITION": position}, "indices": index,
                     "material": self._append("materials", material)}
        mesh = self._append("meshes", {"name": f"lamp {name}", "primitives": [primitive]})
        self._add_node({"name": name, "matrix": columns(rows), "mesh": mesh})

    def _add_accessor(self, data: bytes, accessor: Dict[str, Any]) -> int:
        view = {"byteOffset": len(self.data), "byteLength": len(data)}
        self.data += data
        self._views.append(view)
        return self._append("accessors", {**accessor, "bufferView": self._append("bufferViews", view)})

    def _add_node(self, node: Dict[str, Any]) -> None:
        number = self._append("nodes", node)
        scenes = self.document.setdefault("scenes", [{}])
        scenes[self.document.get("scene", 0)].setdefault("nodes", []).append(number)

    def _append(self, kind: str, value: Dict[str, Any]) -> int:
        values = self.document.setdefault(kind, [])
        values.append(value)
        return len(values) - 1

    def _use(self, extension: str) -> None:
        used = self.document.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)


def renders(thing: Any) -> bool:
    """Whether an object, or what instances it, is to be seen in renders."""
    collections = thing.users_collection
    return not thing.hide_render and not (collections and all(c.hide_render for c in collections))


def lamps_of(depsgraph: Any) -> Iterator[Tuple[str, Any, Any]]:
    """(name, lamp, matrix) of each that shines, also those of instanced collections."""
    for instance in depsgraph.object_instances:
        thing = instance.object
        if thing.type != "LIGHT" or not renders(thing.original):
            continue
        if instance.is_instance and instance.parent is not None and not renders(instance.parent.original):
            continue
        yield thing.name, thing.data, instance.matrix_world.copy()

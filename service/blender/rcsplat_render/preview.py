"""Blender's small scene around a material, in a document of our own: the exporter sees the file's scenes alone."""

from __future__ import annotations

import pathlib
from typing import Any, Dict, List

import numpy

from . import gltf_file
from .axes import columns, up_rows
from .cameras import Seen
from .jobs import Framing, frame_of, output
from .lamps import Lamps, lamps_of, renders
from .materials import entry_of
from .snapshot import Snapshot
from .worlds import world_of

FLOAT, UINT, VERTICES = 5126, 5125, {1: "SCALAR", 2: "VEC2", 3: "VEC3"}


class _Document:
    """Grows by meshes, whose numbers lie in one buffer."""

    def __init__(self) -> None:
        self.root: Dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        self.data = bytearray()
        self._materials: Dict[str, int] = {}

    def append(self, kind: str, value: Dict[str, Any]) -> int:
        values = self.root.setdefault(kind, [])
        values.append(value)
        return len(values) - 1

    def accessor(self, values: Any, component: int, bounded: bool = False) -> int:
        data = numpy.ascontiguousarray(values, dtype="<f4" if component == FLOAT else "<u4")
        width = data.shape[1] if data.ndim == 2 else 1
        view = self.append("bufferViews", {"buffer": 0, "byteOffset": len(self.data), "byteLength": data.nbytes})
        self.data += data.tobytes()
        entry = {"bufferView": view, "componentType": component, "count": len(data), "type": VERTICES[width]}
        if bounded:
            entry.update(min=data.min(axis=0).tolist(), max=data.max(axis=0).tolist())
        return self.append("accessors", entry)

    def material(self, material: Any) -> int:
        if material.name not in self._materials:
            self._materials[material.name] = self.append("materials", entry_of(material))
        return self._materials[material.name]

    def add(self, name: str, mesh: Any, slots: List[Any], matrix: Any) -> None:
        """@param slots  materials of the object"""
        if hasattr(mesh, "calc_normals_split"):  # before Blender 4.1
            mesh.calc_normals_split()
        mesh.calc_loop_triangles()
        corners = numpy.empty(3 * len(mesh.loop_triangles), dtype=numpy.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        if not len(corners):
            return
        places = numpy.empty(3 * len(mesh.vertices), dtype=numpy.float32)
        mesh.vertices.foreach_get("co", places)
        normals = numpy.array([n for t in mesh.loop_triangles for n in t.split_normals], dtype=numpy.float32)
        chosen = numpy.array([t.material_index for t in mesh.loop_triangles])
        position = self.accessor(places.reshape(-1, 3)[corners], FLOAT, bounded=True)
        attributes = {"POSITION": position, "NORMAL": self.accessor(normals.reshape(-1, 3), FLOAT)}
        primitives = []
        for index in sorted(set(chosen.tolist())):
            faces = numpy.flatnonzero(chosen == index)
            order = (3 * faces[:, None] + numpy.arange(3)[None, :]).reshape(-1)
            primitive = {"attributes": attributes, "indices": self.accessor(order, UINT)}
            if index < len(slots) and slots[index] is not None:
                primitive["material"] = self.material(slots[index])
            primitives.append(primitive)
        number = self.append("meshes", {"name": name, "primitives": primitives})
        node = self.append("nodes", {"name": name, "mesh": number, "matrix": columns(up_rows(matrix))})
        self.root["scenes"][0]["nodes"].append(node)


def take(depsgraph: Any, folder: pathlib.Path) -> Snapshot:
    """All meshes, lamps and the world that the dependency graph has, materials by the values of their shaders."""
    document = _Document()
    for instance in depsgraph.object_instances:
        thing = instance.object
        if thing.type not in ("MESH", "CURVE", "SURFACE", "META", "FONT") or not renders(thing.original):
            continue
        mesh = thing.to_mesh()
        if mesh is not None:
            document.add(thing.name, mesh, [slot.material for slot in thing.material_slots],
                         instance.matrix_world.copy())
            thing.to_mesh_clear()
    used = {name for entry in document.root.get("materials", []) for name in entry.get("extensions", {})}
    if used:
        document.root["extensionsUsed"] = sorted(used)
    if document.data:
        name = gltf_file.keep(folder, "preview", ".bin", bytes(document.data))
        document.root["buffers"] = [{"uri": name, "byteLength": len(document.data)}]
    lamps = Lamps(document.root, False)
    for name, lamp, matrix in lamps_of(depsgraph):
        lamps.add(name, lamp, matrix)
    if lamps.data:
        lamps.finish(gltf_file.keep(folder, "lamps", ".bin", bytes(lamps.data)))
    return Snapshot(gltf_file.write_document(document.root, folder), world_of(depsgraph.scene, folder), [])


def request(framing: Framing, seen: Seen, snapshot: Snapshot) -> Dict[str, Any]:
    """All of submit(): soon there rather than without noise."""
    return {"bounces": 1, "aa": 4, "target_error": 0.1, "width": framing.size[0], "height": framing.size[1],
            "environment": snapshot.world.environment, "environment_rotation": snapshot.world.rotation,
            "frames": [frame_of(0, seen.camera)], "outputs": [output(["emission"])], "priority": 60,
            "labels": {"client": "blender", "kind": "preview"}}

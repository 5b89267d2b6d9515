"""A scene as Blender shows it now, in files that the server takes: Blender's own glTF exporter, and what it leaves
out."""

from __future__ import annotations

import contextlib
import json
import pathlib
import shutil
import tempfile
from typing import Any, Dict, Iterator, List, NamedTuple

import bpy

from . import gltf_file
from .lamps import Lamps, lamps_of
from .materials import put_right
from .worlds import World, world_of

# Left out with a warning, by the type of the object.
UNKNOWN = {"VOLUME": "a volume", "CURVES": "hair", "POINTCLOUD": "a point cloud", "GPENCIL": "a grease pencil",
           "GREASEPENCIL": "a grease pencil", "LIGHT_PROBE": ""}
EXPORT: Dict[str, Any] = {
    "export_format": "GLTF_SEPARATE", "export_apply": True, "export_cameras": False, "export_lights": False,
    "export_animations": False, "export_skins": False, "export_morph": False, "export_current_frame": True,
    "export_extras": False, "export_tangents": False, "export_yup": True, "use_active_scene": True,
    "export_gn_mesh": True, "will_save_settings": False, "check_existing": False,
}


class Snapshot(NamedTuple):
    """Files lie in one folder, named by their content."""

    scene: pathlib.Path
    world: World
    warnings: List[str]

    def same_as(self, other: "Snapshot") -> bool:
        return (self.scene.name, self.world.environment, self.world.rotation) == (
            other.scene.name, other.world.environment, other.world.rotation)


@contextlib.contextmanager
def _as_rendered(scene: Any) -> Iterator[None]:
    """The exporter applies modifiers as viewports show them: they are switched to what renders show meanwhile."""
    changed = []
    for thing in scene.objects:
        for modifier in thing.modifiers:
            wanted = {"show_viewport": modifier.show_render}
            if modifier.type in ("SUBSURF", "MULTIRES"):
                wanted["levels"] = modifier.render_levels
            for name, value in wanted.items():
                if getattr(modifier, name) != value:
                    changed.append((modifier, name, getattr(modifier, name)))
                    setattr(modifier, name, value)
    try:
        if changed:
            bpy.context.view_layer.update()
        yield
    finally:
        for modifier, name, value in changed:
            setattr(modifier, name, value)


def _exported(scene: Any, folder: pathlib.Path, final: bool) -> Dict[str, Any]:
    """The exporter's document, its buffers and images in the folder."""
    options = {**EXPORT, "use_renderable": final, "use_visible": not final}
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    with tempfile.TemporaryDirectory(dir=folder) as name:
        path = pathlib.Path(name) / "scene.gltf"
        with _as_rendered(scene) if final else contextlib.nullcontext():
            outcome = bpy.ops.export_scene.gltf(
                filepath=str(path), **{key: value for key, value in options.items() if key in known})
        if "FINISHED" not in outcome or not path.exists():
            raise RuntimeError("Blender's glTF exporter wrote nothing")
        document: Dict[str, Any] = json.loads(path.read_text())
        gltf_file.split_buffers(document, path.parent, folder)
        gltf_file.name_images(document, path.parent, folder)
    return document


def _unknown(depsgraph: Any) -> List[str]:
    found = []
    for thing in depsgraph.objects:
        if UNKNOWN.get(thing.type):
            found.append(f"object '{thing.name}' is {UNKNOWN[thing.type]}, and left out")
        for system in thing.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                found.append(f"object '{thing.name}': its hair is left out")
    return found


def take(depsgraph: Any, folder: pathlib.Path, final: bool, soft: bool) -> Snapshot:
    """Belongs to Blender's main thread. @param final  what renders see, else what viewports do
    @param soft  lamps with a radius have it"""
    scene = depsgraph.scene
    document = _exported(scene.original, folder, final)
    warnings = _unknown(depsgraph) + put_right(document, bpy.data.materials)
    lamps = Lamps(document, soft)
    for name, lamp, matrix in lamps_of(depsgraph):
        lamps.add(name, lamp, matrix)
    if lamps.data:
        lamps.finish(gltf_file.keep(folder, "lamps", ".bin", bytes(lamps.data)))
    world = world_of(scene, folder)
    return Snapshot(gltf_file.write_document(document, folder), world,
                    list(dict.fromkeys(warnings + lamps.warnings + world.warnings)))


class Folder:
    """Where snapshots lie until Blender ends."""

    def __init__(self) -> None:
        self._path: "pathlib.Path | None" = None

    def path(self) -> pathlib.Path:
        if self._path is None or not self._path.exists():
            self._path = pathlib.Path(tempfile.mkdtemp(prefix="rcsplat-blender-"))
        return self._path

    def remove(self) -> None:
        if self._path is not None:
            shutil.rmtree(self._path, ignore_errors=True)
            self._path = None


FOLDER = Folder()

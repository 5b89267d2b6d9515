"""What Blender's exporter wrote, in parts named by their content: what did not change is not uploaded again."""

from __future__ import annotations

import hashlib
import json
import pathlib
from typing import Any, Dict, Iterator, List
from urllib.parse import unquote


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def keep(folder: pathlib.Path, stem: str, ending: str, data: bytes) -> str:
    """Writes a file unless it is there; its name."""
    name = f"{stem}-{digest(data)}{ending}"
    path = folder / name
    if not path.exists():
        temporary = folder / f".{name}"
        temporary.write_bytes(data)
        temporary.replace(path)
    return name


def _views_of(document: Dict[str, Any], mesh: Dict[str, Any]) -> Iterator[int]:
    for primitive in mesh["primitives"]:
        accessors = [*primitive["attributes"].values(), primitive.get("indices", -1)]
        for target in primitive.get("targets", []):
            accessors += target.values()
        for accessor in accessors:
            if accessor >= 0 and "bufferView" in document["accessors"][accessor]:
                yield document["accessors"][accessor]["bufferView"]


def split_buffers(document: Dict[str, Any], source: pathlib.Path, folder: pathlib.Path) -> None:
    """A buffer for each mesh, in the place of one for all."""
    old = [(source / unquote(buffer["uri"])).read_bytes() for buffer in document.get("buffers", [])]
    views = document.get("bufferViews", [])
    left = set(range(len(views)))
    buffers: List[Dict[str, Any]] = []
    numbers: Dict[str, int] = {}

    def move(stem: str, chosen: List[int]) -> None:
        data = bytearray()
        for number in chosen:
            view = views[number]
            begin = view.get("byteOffset", 0)
            part = old[view["buffer"]][begin:begin + view["byteLength"]]
            view["byteOffset"] = len(data)
            data += part + bytes(-len(part) % 4)
        name = keep(folder, stem, ".bin", bytes(data))
        if name not in numbers:
            numbers[name] = len(buffers)
            buffers.append({"uri": name, "byteLength": len(data)})
        for number in chosen:
            views[number]["buffer"] = numbers[name]

    for mesh in document.get("meshes", []):
        chosen = sorted(left.intersection(_views_of(document, mesh)))
        left -= set(chosen)
        if chosen:
            move("mesh", chosen)
    if left:
        move("rest", sorted(left))
    if old:
        document["buffers"] = buffers


def name_images(document: Dict[str, Any], source: pathlib.Path, folder: pathlib.Path) -> None:
    for image in document.get("images", []):
        if "uri" in image and not image["uri"].startswith("data:"):
            path = source / unquote(image["uri"])
            image["uri"] = keep(folder, "image", path.suffix.lower(), path.read_bytes())


def write_document(document: Dict[str, Any], folder: pathlib.Path) -> pathlib.Path:
    """@return the file, whose name stands for all that the scene is"""
    data = json.dumps(document, sort_keys=True, separators=(",", ":")).encode()
    return folder / keep(folder, "scene", ".gltf", data)

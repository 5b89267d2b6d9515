"""Which files a scene is made of."""

from __future__ import annotations

import json
import pathlib
import struct
from typing import Any, Dict, List
from urllib.parse import unquote


def _document(path: pathlib.Path) -> Dict[str, Any]:
    with path.open("rb") as file:
        head = file.read(20)
        if head[:4] == b"glTF" and len(head) == 20:
            text = file.read(struct.unpack("<I", head[12:16])[0])
        else:
            text = head + file.read()
    try:
        document = json.loads(text)
    except ValueError as error:
        raise ValueError(f"{path}: no glTF file: {error}") from None
    if not isinstance(document, dict):
        raise ValueError(f"{path}: no glTF file: it is no JSON object")
    return document


def scene_files(path: pathlib.Path) -> List[str]:
    """The .gltf or .glb file itself, then the buffers and images that it names, relative to its folder."""
    names = [path.name]
    document = _document(path)
    for kind in ("buffers", "images"):
        for element in document.get(kind, []):
            uri = element.get("uri", "data:")
            if uri.startswith("data:"):
                continue
            name = unquote(uri)
            if name.startswith("/") or ":" in name.split("/")[0] or ".." in name.split("/"):
                raise ValueError(f"{path}: '{uri}' is no relative path inside the scene's folder")
            if name not in names:
                names.append(str(pathlib.PurePosixPath(name)))
    return names

"""Blender before 4.2 knows no wheels of add-ons: they are unpacked to a folder of the user's and found there."""

from __future__ import annotations

import hashlib
import importlib.util
import pathlib
import sys
import tempfile
import zipfile


def find_wheels(package: pathlib.Path, cache: pathlib.Path) -> None:
    """Where the client cannot be imported yet. @param cache  folder that unpacked wheels lie in"""
    if importlib.util.find_spec("rcsplat") is not None:
        return
    wheels = sorted((package / "wheels").glob("*.whl"))
    stamp = hashlib.sha256("".join(f"{w.name}{w.stat().st_size}{w.stat().st_mtime_ns}" for w in wheels).encode())
    folder = cache / f"wheels-{stamp.hexdigest()[:12]}"
    if wheels and not folder.exists():
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=cache) as name:
            made = pathlib.Path(name) / "made"
            for wheel in wheels:
                with zipfile.ZipFile(wheel) as file:
                    file.extractall(made)
            made.replace(folder)
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()

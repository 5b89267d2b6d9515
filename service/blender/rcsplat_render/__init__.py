"""rcsplat as a render engine of Blender: docs/blender.md."""

import atexit
import pathlib
from typing import Any, List

import bpy

from . import vendor

bl_info = {
    "name": "rcsplat",
    "author": "rcsplat",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Render properties: Render Engine",
    "description": "Render by radiance cache splatting, here or on a server",
    "category": "Render",
}

vendor.find_wheels(pathlib.Path(__file__).parent, pathlib.Path(bpy.utils.user_resource("CONFIG")) / "rcsplat")

from . import engine, link, operators, panels, server, settings, snapshot  # noqa: E402  (in wheels)

MODULES: List[Any] = [settings, engine, operators, panels]


def end() -> None:
    """What would outlive Blender."""
    link.LINK.stop()
    server.SERVER.stop()
    snapshot.FOLDER.remove()


def register() -> None:
    for module in MODULES:
        module.register()
    atexit.register(end)


def unregister() -> None:
    atexit.unregister(end)
    for module in reversed(MODULES):
        module.unregister()
    end()

"""What a scene says of its renders, and the add-on's preferences."""

from __future__ import annotations

from typing import Any, Dict

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from .link import Place

GOALS = (("ERROR", "Error", "Render until the picture's mean relative error is estimated to be this small"),
         ("BUDGET", "Time", "Render for this long, and make the best of it"))


class RcsplatSettings(bpy.types.PropertyGroup):
    """Of a scene."""

    __annotations__ = {
        "goal": EnumProperty(name="Render until", items=GOALS, default="ERROR"),
        "target_error": FloatProperty(name="Error", subtype="PERCENTAGE", default=5.0, min=0.1, max=100.0, precision=1,
                                      description="Mean relative error of the picture and of its indirect light"),
        "budget": FloatProperty(name="Seconds", default=20.0, min=0.1, soft_max=3600.0,
                                description="Wall time of a picture [s]"),
        "bounces": IntProperty(name="Bounces", default=4, min=0, max=64,
                               description="Of indirect light; 8 is about all there is"),
        "aa": IntProperty(name="Samples a pixel", default=4, min=1, max=256,
                          description="Edges, depth of field and textures; noise of light is what the error is for"),
        "seed": IntProperty(name="Seed", default=1, min=0),
        "soft_lamps": BoolProperty(name="Soft point lamps", default=True,
                                   description="Point lamps with a radius shine from a small sphere, which is seen, "
                                               "and cast soft shadows; else from a point"),
        "priority": IntProperty(name="Priority", default=0, min=-100, max=100, description="In the server's queue"),
    }


class RcsplatPreferences(bpy.types.AddonPreferences):
    """Of the user."""

    bl_idname = __package__
    __annotations__ = {
        "address": StringProperty(name="Server",
                                  description="Path of a socket, or HOST:PORT; empty: this machine's own"),
        "token": StringProperty(name="Token", subtype="PASSWORD", description="Of a server on TCP (its STATE/token)"),
        "program": StringProperty(name="rcsplat", subtype="FILE_PATH",
                                  description="What is started where no server answers; empty: in the path"),
        "may_start": BoolProperty(name="Start a server where none answers", default=True,
                                  description="It ends with Blender"),
    }

    def draw(self, context: Any) -> None:
        for name in ("address", "token", "program", "may_start"):
            self.layout.prop(self, name)


def place() -> Place:
    """As the preferences say; belongs to Blender's main thread, or to a render."""
    addon = bpy.context.preferences.addons.get(__package__)
    if addon is None or addon.preferences is None:
        return Place()
    given = addon.preferences
    program = bpy.path.abspath(given.program) if given.program else ""
    return Place(given.address, given.token, program, given.may_start)


def render_options(scene: Any) -> Dict[str, Any]:
    """Of submit(), but for size and camera."""
    own = scene.rcsplat
    options: Dict[str, Any] = {"bounces": own.bounces, "aa": own.aa, "seed": own.seed}
    if own.goal == "BUDGET":
        options["budget_seconds"] = float(own.budget)
    else:
        options["target_error"] = round(own.target_error / 100.0, 6)
    return options



CLASSES = (RcsplatSettings, RcsplatPreferences)


def register() -> None:
    for kind in CLASSES:
        bpy.utils.register_class(kind)
    bpy.types.Scene.rcsplat = PointerProperty(type=RcsplatSettings)


def unregister() -> None:
    del bpy.types.Scene.rcsplat
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)

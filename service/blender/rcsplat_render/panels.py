"""Panels of the render and view layer properties."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy

from . import night, operators, pictures
from .engine import REPORT

# Of Blender's own, those that hold for this engine, too.
SHARED = ("RENDER_PT_format", "RENDER_PT_frame_range", "RENDER_PT_output", "RENDER_PT_output_color_management",
          "RENDER_PT_color_management", "RENDER_PT_post_processing", "RENDER_PT_stamp", "RENDER_PT_time_stretching",
          "DATA_PT_lens", "DATA_PT_camera", "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture", "DATA_PT_light",
          "DATA_PT_EEVEE_light", "DATA_PT_context_light", "DATA_PT_spot", "WORLD_PT_context_world",
          "EEVEE_WORLD_PT_surface", "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface",
          "MATERIAL_PT_preview", "VIEWLAYER_PT_layer", "RENDER_PT_gpencil")


def columns_of(context: Any) -> int:
    """About how many letters are wide as a panel with an icon."""
    letter = 7.0 * float(context.preferences.system.ui_scale)
    return max(16, int(context.region.width / letter) - 7)


class _Panel(bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return bool(context.engine == "RCSPLAT")


class RCSPLAT_PT_render(_Panel):
    bl_label = "Light"

    def draw(self, context: Any) -> None:
        layout, own = self.layout, context.scene.rcsplat
        layout.use_property_split = True
        layout.row().prop(own, "goal", expand=True)
        layout.prop(own, "target_error" if own.goal == "ERROR" else "budget")
        for name in ("bounces", "aa", "soft_lamps", "seed"):
            layout.prop(own, name)
        layout.prop(context.scene.render, "film_transparent")
        layout.operator("rcsplat.forecast")
        if REPORT.forecast:
            layout.label(text=REPORT.forecast, icon="TIME")


class RCSPLAT_PT_plan(_Panel):
    bl_label = "Effects of the last render"

    def draw(self, context: Any) -> None:
        if not REPORT.last:
            self.layout.label(text="nothing was rendered yet")
            return
        self.layout.label(text=f"{REPORT.last.get('seconds', 0.0):.3g} s, {REPORT.sent} bytes uploaded")
        for effect in REPORT.last.get("plan", {}).get("effects", []):
            needed = effect.get("needed", False)
            lines = self.layout.column(align=True)
            lines.label(text=effect["name"], icon="CHECKBOX_HLT" if needed else "CHECKBOX_DEHLT")
            for line in textwrap.wrap(effect.get("reason", ""), columns_of(context)):
                lines.label(text=line, icon="BLANK1")


class RCSPLAT_PT_night(_Panel):
    bl_label = "Night"

    def draw(self, context: Any) -> None:
        layout, scene = self.layout, context.scene
        layout.prop(scene.rcsplat, "priority")
        frames = len(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
        layout.operator("rcsplat.queue", text=f"Send {frames} frames to queue")
        if night.nights():
            layout.label(text=operators.WATCH.line or "frames are queued")
            row = layout.row()
            row.operator("rcsplat.fetch")
            row.operator("rcsplat.cancel_queue")


class RCSPLAT_PT_passes(_Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: Any) -> None:
        self.layout.use_property_split = True
        for switch in [entry.switch for entry in pictures.PASSES] + [switch for _, switch in pictures.CRYPTOMATTES]:
            self.layout.prop(context.view_layer, switch)


CLASSES = (RCSPLAT_PT_render, RCSPLAT_PT_plan, RCSPLAT_PT_night, RCSPLAT_PT_passes)


def register() -> None:
    for kind in CLASSES:
        bpy.utils.register_class(kind)
    for name in SHARED:
        panel = getattr(bpy.types, name, None)
        if panel is not None and hasattr(panel, "COMPAT_ENGINES"):
            panel.COMPAT_ENGINES.add("RCSPLAT")


def unregister() -> None:
    for name in SHARED:
        panel = getattr(bpy.types, name, None)
        if panel is not None and hasattr(panel, "COMPAT_ENGINES"):
            panel.COMPAT_ENGINES.discard("RCSPLAT")
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)

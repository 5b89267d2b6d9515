"""A viewport that refines: pictures of an eighth, a quarter, half of its size, each a job, shown as they arrive.

Blender is called in its main thread alone: timers export what changed, and look for pictures."""

from __future__ import annotations

import time
from typing import Any, Dict, Optional, Tuple

import bpy
import gpu
import numpy
from gpu_extras.presets import draw_texture_2d

from . import pictures, settings
from .cameras import seen_in_viewport
from .jobs import frame_of, output
from .link import LINK, Rendering, one_line
from .snapshot import FOLDER, Snapshot, take

STEPS = ((8, 0.3), (4, 0.15), (2, 0.08), (1, 0.05))  # parts of the size, error
QUIET = 0.15  # without a change before it begins [s]


def _load_image(name: str) -> Any:
    """For Blenders without OpenImageIO: four values a pixel."""
    image = bpy.data.images.load(name)
    try:
        width, height = image.size
        values = numpy.empty(width * height * image.channels, dtype=numpy.float32)
        image.pixels.foreach_get(values)
        pixels = values.reshape(-1, image.channels)
        return pixels if image.channels == 4 else numpy.repeat(pixels[:, :1], 4, axis=1)
    finally:
        bpy.data.images.remove(image)


class Viewport:
    """Of one engine."""

    def __init__(self, engine: Any) -> None:
        self.engine = engine
        self.snapshot: Optional[Snapshot] = None
        self.texture: Any = None
        self.line = ""
        self._view: "Tuple[Any, ...]" = ()
        self._camera: Any = None
        self._options: Dict[str, Any] = {}
        self._step = self._shown = 0
        self._dirty, self._exporting = True, False
        self._changed = 0.0
        self._rendering: Optional[Rendering] = None

    def update(self) -> None:
        """The scene changed. It is exported by the timer: Blender waits for itself where it is done here."""
        if not self._exporting:
            self._dirty = True
            self._begin()

    def _export(self) -> bool:
        """Whether there is something new to show."""
        self._dirty, self._exporting = False, True
        try:
            depsgraph = bpy.context.evaluated_depsgraph_get()
            scene = depsgraph.scene
            snapshot = take(depsgraph, FOLDER.path(), False, scene.rcsplat.soft_lamps)
        finally:
            self._exporting = False
        world = snapshot.world
        options = {**settings.render_options(scene), "aa": 1, "environment": world.environment,
                   "environment_rotation": world.rotation}
        options.pop("budget_seconds", None)
        if self.snapshot is not None and snapshot.same_as(self.snapshot) and options == self._options:
            return False
        self.snapshot, self._options, self._shown = snapshot, options, 0
        return True

    def draw(self, context: Any, depsgraph: Any) -> None:
        region, data = context.region, context.region_data
        size = (region.width, region.height)
        view = (size, tuple(tuple(row) for row in data.perspective_matrix))
        if view != self._view:
            self._view, self._camera = view, seen_in_viewport(data, context.space_data, size)
            self._shown = 0
            self._begin()
        if self.texture is not None:
            self.engine.bind_display_space_shader(depsgraph.scene)
            gpu.state.blend_set("ALPHA_PREMULT")
            draw_texture_2d(self.texture, (0, 0), *size)
            self.engine.unbind_display_space_shader()
        self.engine.update_stats("rcsplat", self.line)

    def _begin(self) -> None:
        if self._rendering is not None:
            self._rendering.cancel()
        self._rendering, self._step, self._changed = None, 0, time.monotonic()
        if not bpy.app.timers.is_registered(self.turn):
            bpy.app.timers.register(self.turn, first_interval=QUIET)

    def stop(self) -> None:
        if self._rendering is not None:
            self._rendering.cancel()
        if bpy.app.timers.is_registered(self.turn):
            bpy.app.timers.unregister(self.turn)

    def turn(self) -> Optional[float]:
        """Seconds until the next; none: all is shown."""
        try:
            return self._turn()
        except ReferenceError:  # the viewport was closed
            self._rendering = None
            return None
        except Exception as error:
            self.line = one_line(error)
            return None

    def _turn(self) -> Optional[float]:
        if not self._view or time.monotonic() - self._changed < QUIET:
            return 0.05
        if self._dirty and not self._export() and self.texture is not None and self._step == 0:
            self._step = self._shown
        if self.snapshot is None or self._step >= len(STEPS):
            return None
        if self._rendering is None:
            self._rendering = self._ask(self.snapshot)
            return 0.02
        ticket = self._rendering.ticket
        if not ticket.done:
            return 0.02
        self._rendering = None
        if ticket.failure:
            self.line = ticket.failure
            self.engine.tag_redraw()
            return None
        self._show(ticket.data)
        self._step += 1
        self._shown = self._step
        self.line = f"error {100.0 * (ticket.error or 0.0):.2g} %"
        self.engine.tag_redraw()
        return 0.0 if self._step < len(STEPS) else None

    def _ask(self, snapshot: Snapshot) -> Rendering:
        part, error = STEPS[self._step]
        size = [max(1, length // part) for length in self._view[0]]
        wanted = {**self._options, "width": size[0], "height": size[1], "frames": [frame_of(0, self._camera)],
                  "target_error": max(error, self._options.get("target_error", 0.0)), "outputs": [output(["emission"])],
                  "priority": 50, "labels": {"client": "blender", "kind": "viewport"}}
        return LINK.render(settings.place(), snapshot.scene, wanted)

    def _show(self, data: bytes) -> None:
        beauty = pictures.combined(pictures.Picture(data, FOLDER.path(), _load_image))
        height, width = beauty.shape[:2]
        buffer = gpu.types.Buffer("FLOAT", width * height * 4, pictures.flat_rows(beauty).tolist())
        self.texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer)

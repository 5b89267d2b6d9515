"""The render engine: what Blender asks of it, answered by a server."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any, Callable, Dict, List, Optional, Tuple

import bpy
import numpy
from mathutils import Vector

from . import pictures, preview, settings
from .cameras import clipped, seen_through
from .jobs import framing_of, still
from .link import LINK, Rendering, Ticket, one_line
from .snapshot import FOLDER, Snapshot, take
from .viewport import Viewport

_LOG = logging.getLogger("rcsplat")
POLL = 0.05  # for Esc, and the end [s]
TELL = 0.5  # how far it is [s]


def in_main_thread(work: Callable[[], Any], is_broken: Callable[[], bool]) -> Any:
    """What Blender's main thread makes of it: operators may not run in the thread that renders."""
    if threading.current_thread() is threading.main_thread():
        return work()
    done = threading.Event()
    outcome: List[Tuple[Any, Optional[Exception]]] = []

    def turn() -> None:
        try:
            outcome.append((work(), None))
        except Exception as error:  # it belongs to who waits
            outcome.append((None, error))
        done.set()

    bpy.app.timers.register(turn, first_interval=0.0)
    while not done.wait(POLL):
        if is_broken() and bpy.app.timers.is_registered(turn):
            bpy.app.timers.unregister(turn)
            raise InterruptedError("cancelled")
    value, error = outcome[0]
    if error is not None:
        raise error
    return value


def snapshot_now(scene: Any, soft: bool) -> Snapshot:
    """Of the scene at its current frame. Belongs to the main thread."""
    scene = scene.original
    window_scene = bpy.context.scene
    if window_scene is not None and window_scene != scene:
        raise ValueError(f"scene '{scene.name}' is not the window's: switch to it to render it")
    scene.frame_set(scene.frame_current, subframe=scene.frame_subframe)
    return take(bpy.context.evaluated_depsgraph_get(), FOLDER.path(), True, soft)


class RcsplatEngine(bpy.types.RenderEngine):
    """See the module."""

    bl_idname = "RCSPLAT"
    bl_label = "rcsplat"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True
    bl_use_gpu_context = False

    def render(self, depsgraph: Any) -> None:
        """F12, each frame of an animation, and the picture of a material."""
        try:
            if self.is_preview:
                self._render_preview(depsgraph)
            else:
                self._render(depsgraph)
        except InterruptedError:
            pass
        except Exception as error:  # Blender goes on, and says it in one line
            _LOG.debug("the render failed", exc_info=True)
            self._fail(depsgraph, one_line(error))

    def _fail(self, depsgraph: Any, line: str) -> None:
        """Leaves black: writing a picture that was never begun ends Blender."""
        _, _, width, height = framing_of(depsgraph.scene.render).window
        self.end_result(self.begin_result(0, 0, width, height, layer=depsgraph.view_layer_eval.name))
        self.report({"ERROR"}, f"rcsplat: {line}")

    def _render(self, depsgraph: Any) -> None:
        scene = depsgraph.scene
        if scene.camera is None:
            raise ValueError("the scene has no camera")
        framing, camera = framing_of(scene.render), scene.camera.evaluated_get(depsgraph)
        self.update_stats("", "exports the scene")
        seen = seen_through(camera, scene.render, framing.size)
        snapshot, place = in_main_thread(
            lambda: (snapshot_now(scene, scene.rcsplat.soft_lamps), settings.place()), self.test_break)
        corners = [thing.matrix_world @ Vector(corner) for thing in depsgraph.objects if thing.type == "MESH"
                   for corner in thing.bound_box]
        for line in seen.warnings + snapshot.warnings + clipped(camera, corners):
            self.report({"WARNING"}, f"rcsplat: {line}")
        layer = depsgraph.view_layer_eval
        passes = pictures.passes_of(layer)
        layers = pictures.layers_for(passes)
        rendering = LINK.render(place, snapshot.scene, still(scene, framing, seen, snapshot, layers))
        if self._wait(rendering):
            sky = snapshot.world.environment if scene.render.film_transparent else None
            axis = pictures.cosines(framing.size, framing.window, seen.camera)
            self._show(rendering.ticket.data, passes, axis, sky if isinstance(sky, tuple) else None, layer.name)

    def _render_preview(self, depsgraph: Any) -> None:
        """Of Blender's own scene for it, which its exporter does not see."""
        scene = depsgraph.scene
        framing = framing_of(scene.render)
        seen = seen_through(scene.camera.evaluated_get(depsgraph), scene.render, framing.size)
        snapshot = preview.take(depsgraph, FOLDER.path())
        place = in_main_thread(settings.place, self.test_break)
        rendering = LINK.render(place, snapshot.scene, preview.request(framing, seen, snapshot))
        if self._wait(rendering):
            axis = pictures.cosines(framing.size, framing.window, seen.camera)
            self._show(rendering.ticket.data, [], axis, None, depsgraph.view_layer_eval.name)

    def _wait(self, rendering: Rendering) -> bool:
        """Whether there is a picture."""
        ticket, told, shown = rendering.ticket, 0.0, ""
        while not ticket.done:
            if self.test_break():
                rendering.cancel()
                return False
            if time.monotonic() - told >= TELL:
                told = time.monotonic()
                shown = self._tell(ticket, shown)
            time.sleep(POLL)
        if ticket.failure:
            raise OSError(ticket.failure)
        if not self.is_preview:
            for line in ticket.warnings:
                self.report({"WARNING"}, f"rcsplat: {line}")
            REPORT.last, REPORT.sent, REPORT.waited = ticket.stats, ticket.sent, ticket.waited
        return True

    def _tell(self, ticket: Ticket, shown: str) -> str:
        """How far it is, where that is news: Blender draws its window each time, and hears no key meanwhile."""
        parts = [ticket.stage]
        if ticket.error:
            parts.append(f"error {100.0 * ticket.error:.2g} %")
        if ticket.eta is not None:
            parts.append(f"{ticket.eta:.0f} s to go")
        line = " | ".join(parts)
        news = f"{line} {ticket.fraction:.2f}"
        if news != shown:
            self.update_progress(ticket.fraction)
            self.update_stats("", line)
        return news

    def _show(self, data: bytes, passes: List[pictures.Pass], axis: Any, sky: Any, layer: str) -> None:
        height, width = axis.shape
        result = self.begin_result(0, 0, width, height, layer=layer)
        try:
            shown = result.layers[0]
            known = {found.name: found for found in shown.passes}

            def load(name: str) -> Any:
                """By way of the layer's Combined, which Blender knows to read files to in a render."""
                shown.load_from_file(name)
                values = numpy.empty(4 * width * height, dtype=numpy.float32)
                _fill(known["Combined"].rect.foreach_get, values, 4)
                return values

            picture = pictures.Picture(data, FOLDER.path(), load)
            made = {entry.name: pictures.blender_pass(picture, entry, axis) for entry in passes if entry.name in known}
            made["Combined"] = pictures.combined(picture, sky)
            for name, pixels in made.items():
                _fill(known[name].rect.foreach_set, pictures.flat_rows(pixels), pixels.shape[-1])
        finally:  # Blender does not outlive a result without an end
            self.end_result(result)

    def update_render_passes(self, scene: Any = None, renderlayer: Any = None) -> None:
        for entry in pictures.passes_of(renderlayer):
            self.register_pass(scene, renderlayer, entry.name, len(entry.channels), entry.channels, entry.kind)

    def _shown(self) -> Viewport:
        if not hasattr(self, "viewport"):
            self.viewport = Viewport(self)
        return self.viewport

    def view_update(self, context: Any, depsgraph: Any) -> None:
        """Something changed in the scene that a viewport shows."""
        self._shown().update()

    def view_draw(self, context: Any, depsgraph: Any) -> None:
        self._shown().draw(context, depsgraph)


class Report:
    """What the panel says: of the last render, and of the next."""

    last: Dict[str, Any] = {}
    sent = 0
    waited: Optional[float] = None  # from the export to the first of its stages [s]
    forecast = ""


REPORT = Report()


def _fill(call: Callable[[Any], None], values: Any, channels: int) -> None:
    """Hands an array to foreach_set() or foreach_get() of a pass: flat, or in Blender 3 by the pixel."""
    try:
        call(values)
    except TypeError:
        call(values.reshape(-1, channels))


def register() -> None:
    bpy.utils.register_class(RcsplatEngine)


def unregister() -> None:
    bpy.utils.unregister_class(RcsplatEngine)

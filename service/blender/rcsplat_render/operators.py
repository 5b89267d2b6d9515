"""What buttons do: the night's queue. Blender's window lives meanwhile; nothing here runs in another thread."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any, Callable, Optional, Set

import bpy

from . import night, pictures, settings
from .cameras import seen_through
from .engine import REPORT, snapshot_now
from .jobs import framing_of, still
from .link import LINK, Rendering, Ticket, one_line


def redraw_properties(context: Any) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()


class Watch:
    """Looks at the queue now and then, and fetches what is there; by Blender's timer."""

    def __init__(self) -> None:
        self.line = ""
        self._looking: "Optional[Future[night.State]]" = None

    def start(self) -> None:
        if not bpy.app.timers.is_registered(self.turn):
            bpy.app.timers.register(self.turn, first_interval=0.5, persistent=True)

    def stop(self) -> None:
        if bpy.app.timers.is_registered(self.turn):
            bpy.app.timers.unregister(self.turn)

    def turn(self) -> Optional[float]:
        """Seconds until the next; none: there is nothing to look at."""
        found = night.nights()
        if not found:
            return None
        if self._looking is None:
            self._looking = night.look(found)
            return 0.2
        if not self._looking.done():
            return 0.2
        looked, self._looking = self._looking, None
        wrong = night.said(looked)
        if wrong is not None:
            self.line = wrong
            return 15.0
        state = looked.result()
        self.line = "; ".join([state.line, *state.failures[:1]])
        night.fetch(bpy.context.scene, found, state)
        redraw_properties(bpy.context)
        return 0.2 if state.pictures else None if state.ended else 5.0


WATCH = Watch()


class RCSPLAT_OT_queue(bpy.types.Operator):
    """Send the frames of the timeline to the server's queue; pictures come to the output path as they finish."""

    bl_idname = "rcsplat.queue"
    bl_label = "Send to queue"

    def execute(self, context: Any) -> Set[str]:
        """At once, for scripts."""
        collector = night.Collector(context.scene)
        try:
            while collector.step():
                pass
            return self._end(collector, night.submit(collector), wait=True)
        except Exception as error:  # Blender says it in one line
            collector.remove()
            self.report({"ERROR"}, f"rcsplat: {one_line(error)}")
            return {"CANCELLED"}
        finally:
            collector.finish()

    def invoke(self, context: Any, event: Any) -> Set[str]:
        self._collector = night.Collector(context.scene)
        self._sent: "Optional[Future[Any]]" = None
        manager = context.window_manager
        manager.progress_begin(0, self._collector.count)
        self._timer = manager.event_timer_add(0.05, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> Set[str]:
        if event.type == "ESC":
            return self._leave(context, {"CANCELLED"})
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            if self._collector.left:
                self._collector.step()
                context.window_manager.progress_update(self._collector.count - len(self._collector.left))
            elif self._sent is None:
                self._sent = night.submit(self._collector)
            elif self._sent.done():
                return self._leave(context, self._end(self._collector, self._sent, wait=False))
        except Exception as error:
            self.report({"ERROR"}, f"rcsplat: {one_line(error)}")
            return self._leave(context, {"CANCELLED"})
        return {"RUNNING_MODAL"}

    def _leave(self, context: Any, how: Set[str]) -> Set[str]:
        self._collector.finish()
        if how == {"CANCELLED"}:
            self._collector.remove()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        return how

    def _end(self, collector: night.Collector, sent: "Future[Any]", wait: bool) -> Set[str]:
        frames = sent.result() if wait or sent.done() else {}
        for line in collector.warnings:
            self.report({"WARNING"}, f"rcsplat: {line}")
        place = settings.place()
        night.keep([*night.nights(), night.Night(vars(place).copy(), frames)])
        collector.remove()
        jobs = sorted({job for job, _ in frames.values()})
        self.report({"INFO"}, f"rcsplat: {len(frames)} frames are queued, job {jobs[0]}"
                    + (f" to {jobs[-1]}" if len(jobs) > 1 else ""))
        WATCH.start()
        return {"FINISHED"}


def _attempted(operator: Any, work: Callable[[], None]) -> Set[str]:
    """What fails is said in one line."""
    try:
        work()
    except Exception as error:
        operator.report({"ERROR"}, f"rcsplat: {one_line(error)}")
        return {"CANCELLED"}
    return {"FINISHED"}


class RCSPLAT_OT_fetch(bpy.types.Operator):
    """Write the pictures that are there to where their frames were to go, and say how far the rest is."""

    bl_idname = "rcsplat.fetch"
    bl_label = "Fetch"

    def execute(self, context: Any) -> Set[str]:
        return _attempted(self, lambda: self._fetch(context.scene))

    def _fetch(self, scene: Any) -> None:
        while True:
            found = night.nights()
            state = night.look(found).result(120.0)
            night.fetch(scene, found, state)
            if not state.pictures:
                break
        WATCH.line = "; ".join([state.line, *state.failures[:1]])
        self.report({"INFO"}, f"rcsplat: {WATCH.line}")


class RCSPLAT_OT_forget(bpy.types.Operator):
    """Cancel all that Blender has queued and that has not ended."""

    bl_idname = "rcsplat.cancel_queue"
    bl_label = "Cancel queue"

    def execute(self, context: Any) -> Set[str]:
        return _attempted(self, self._cancel)

    @staticmethod
    def _cancel() -> None:
        night.cancelled(night.nights()).result(30.0)
        night.keep([])
        WATCH.line = ""


def forecast_line(scene: Any, ticket: Ticket) -> str:
    if ticket.failure:
        return ticket.failure
    goal = f"{scene.rcsplat.target_error:.3g} %"
    if ticket.forecast is None:  # the picture was there before
        return f"{goal} takes {ticket.stats.get('seconds', 0.0):.2g} s"
    return f"{goal} will take about {ticket.forecast:.{0 if ticket.forecast >= 10.0 else 1}f} s"


class RCSPLAT_OT_forecast(bpy.types.Operator):
    """Ask the server how long a picture of this error will take, without rendering it."""

    bl_idname = "rcsplat.forecast"
    bl_label = "Forecast"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return bool(context.scene.rcsplat.goal == "ERROR" and context.scene.camera is not None)

    def _ask(self, context: Any) -> Rendering:
        scene = context.scene
        snapshot = snapshot_now(scene, scene.rcsplat.soft_lamps)
        framing = framing_of(scene.render)
        camera = scene.camera.evaluated_get(context.evaluated_depsgraph_get())
        seen = seen_through(camera, scene.render, framing.size)
        layers = pictures.layers_for(pictures.passes_of(context.view_layer))
        return LINK.forecast(settings.place(), snapshot.scene, still(scene, framing, seen, snapshot, layers))

    def execute(self, context: Any) -> Set[str]:
        """At once, for scripts."""
        def work() -> None:
            ticket = self._ask(context).wait(300.0)
            REPORT.forecast = forecast_line(context.scene, ticket)
            self.report({"INFO"}, f"rcsplat: {REPORT.forecast}")

        return _attempted(self, work)

    def invoke(self, context: Any, event: Any) -> Set[str]:
        def work() -> None:
            self._asked = self._ask(context)

        if _attempted(self, work) == {"CANCELLED"}:
            return {"CANCELLED"}
        REPORT.forecast = "asks the server"
        self._timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> Set[str]:
        if event.type == "ESC":
            self._asked.cancel()
            return self._leave(context, "")
        if event.type == "TIMER" and self._asked.ticket.done:
            return self._leave(context, forecast_line(context.scene, self._asked.ticket))
        return {"PASS_THROUGH"}

    def _leave(self, context: Any, line: str) -> Set[str]:
        REPORT.forecast = line
        context.window_manager.event_timer_remove(self._timer)
        redraw_properties(context)
        return {"FINISHED"}


CLASSES = (RCSPLAT_OT_queue, RCSPLAT_OT_forecast, RCSPLAT_OT_fetch, RCSPLAT_OT_forget)


def register() -> None:
    for kind in CLASSES:
        bpy.utils.register_class(kind)
    if night.nights():  # of a Blender that was closed
        WATCH.start()


def unregister() -> None:
    WATCH.stop()
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)

"""Pictures as the server is asked for them."""

from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Tuple

from rcsplat import Output, job_pb2, options_pb2

from . import settings
from .cameras import Seen
from .snapshot import Snapshot


class Framing(NamedTuple):
    """The picture, and the window of it that is rendered (x, y from the top, width, height) [px]."""

    size: Tuple[int, int]
    window: Tuple[int, int, int, int]


def framing_of(render: Any) -> Framing:
    scale = render.resolution_percentage / 100.0
    width, height = max(1, int(render.resolution_x * scale)), max(1, int(render.resolution_y * scale))
    if not render.use_border:
        return Framing((width, height), (0, 0, width, height))
    left, right = int(render.border_min_x * width), int(render.border_max_x * width)
    bottom, top = int(render.border_min_y * height), int(render.border_max_y * height)
    return Framing((width, height), (left, height - top, max(1, right - left), max(1, top - bottom)))


def job_options(scene: Any, framing: Framing, seen: Seen, snapshot: Snapshot) -> Dict[str, Any]:
    """Of submit(), but for frames and outputs."""
    options = settings.render_options(scene)
    options.update(width=framing.size[0], height=framing.size[1], **seen.options)
    if framing.window != (0, 0, *framing.size):
        options["crop"] = framing.window
    options.update(environment=snapshot.world.environment, environment_rotation=snapshot.world.rotation)
    return options


def frame_of(number: int, camera: options_pb2.Camera) -> job_pb2.Frame:
    return job_pb2.Frame(number=number, camera_given=camera)


def output(layers: List[str]) -> Output:
    return Output("image.exr", layers=layers, pixel_format="float")


def still(scene: Any, framing: Framing, seen: Seen, snapshot: Snapshot, layers: List[str]) -> Dict[str, Any]:
    """All of submit() for a picture of the current frame."""
    return {**job_options(scene, framing, seen, snapshot), "frames": [frame_of(scene.frame_current, seen.camera)],
            "outputs": [output(layers)], "priority": scene.rcsplat.priority,
            "labels": {"client": "blender", "kind": "still"}}

"""Blender's cameras as the server takes them: field of view, lens shift, parallel projection, depth of field."""

from __future__ import annotations

import math
from typing import Any, Dict, List, NamedTuple, Tuple

from rcsplat import options_pb2

from .axes import columns, rigid, up_rows

FILM_HEIGHT = 0.024  # [m], that the server's f-numbers are before


class Seen(NamedTuple):
    """What a camera sees a picture of some size with."""

    camera: options_pb2.Camera
    options: Dict[str, float]  # f_stop, focus
    warnings: List[str]


def framed(sensor_fit: str, width: int, height: int) -> Tuple[int, str]:
    """The side of the picture [px] that Blender's lens and shift refer to, and which it is."""
    fit = sensor_fit if sensor_fit != "AUTO" else ("HORIZONTAL" if width >= height else "VERTICAL")
    return (width, fit) if fit == "HORIZONTAL" else (height, fit)


def _depth_of_field(data: Any, place: Any, half: float, warnings: List[str]) -> Dict[str, float]:
    if not data.dof.use_dof:
        return {}
    if data.type != "PERSP":
        warnings.append(f"camera '{data.name}': depth of field of a parallel camera is left out")
        return {}
    focus = data.dof.focus_distance
    if data.dof.focus_object is not None:
        offset = data.dof.focus_object.matrix_world.translation - place.translation
        forward = -place.to_3x3().col[2].normalized()
        focus = abs(offset.dot(forward))
    opening = data.lens * 1e-3 / data.dof.aperture_fstop
    return {"f_stop": 0.5 * FILM_HEIGHT / half / opening, "focus": max(focus, 1e-6)}


def seen_through(camera: Any, render: Any, size: Tuple[int, int]) -> Seen:
    """@param camera  an evaluated object @param render  the scene's @param size  of the whole picture [px]"""
    data, warnings = camera.data, []
    width, height = size
    side, _ = framed(data.sensor_fit, width, height)
    message = options_pb2.Camera(name=camera.name, world_from_view=columns(rigid(up_rows(camera.matrix_world))))
    half = 0.0
    if data.type == "ORTHO":
        message.projection = options_pb2.Camera.PROJECTION_ORTHOGRAPHIC
        message.ymag = 0.5 * data.ortho_scale * height / side
    elif data.type == "PERSP":
        sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
        half = 0.5 * sensor / data.lens * height / side
        message.yfov = 2.0 * math.atan(half)
    else:
        raise ValueError(f"camera '{camera.name}' is {data.type.lower()}, expected perspective or orthographic")
    message.lens_shift.right, message.lens_shift.up = data.shift_x * side / height, data.shift_y * side / height
    if abs(render.pixel_aspect_x - render.pixel_aspect_y) > 1e-6:
        warnings.append("pixels are rendered square; the aspect of the output settings is left out")
    options = _depth_of_field(data, camera.matrix_world, half, warnings)
    return Seen(message, options, warnings)


def seen_in_viewport(region_data: Any, space: Any, size: Tuple[int, int]) -> options_pb2.Camera:
    """What a viewport shows that no camera is looked through in."""
    rows = rigid(up_rows(region_data.view_matrix.inverted()))
    message = options_pb2.Camera(name="viewport", world_from_view=columns(rows))
    window = region_data.window_matrix
    if region_data.is_perspective:
        message.yfov = 2.0 * math.atan(1.0 / window[1][1])
        message.lens_shift.right = 0.5 * window[0][2] * size[0] / size[1]
        message.lens_shift.up = 0.5 * window[1][2]
    else:
        message.projection = options_pb2.Camera.PROJECTION_ORTHOGRAPHIC
        message.ymag = 1.0 / window[1][1]
        message.lens_shift.right = -0.5 * window[0][3] * size[0] / size[1]
        message.lens_shift.up = -0.5 * window[1][3]
    return message


def clipped(camera: Any, corners: List[Any]) -> List[str]:
    """A warning where something lies outside of the distances that the camera's clipping keeps: all is rendered."""
    view = camera.matrix_world.inverted()
    depths = [-(view @ corner).z for corner in corners]
    ahead = [depth for depth in depths if depth > 0.0]
    if ahead and max(ahead) > camera.data.clip_end:
        return [f"camera '{camera.name}': what lies beyond its clip end ({camera.data.clip_end:g}) is rendered, too"]
    return []

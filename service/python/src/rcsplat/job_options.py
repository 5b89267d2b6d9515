"""What a job is asked for, and the message that asks for it."""

from __future__ import annotations

import dataclasses
import math
import os
import pathlib
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Set, Tuple, Union

from rcsplat.errors import RenderError, error_of
from rcsplat.render_options import CHOICES, RenderOptions
from rcsplat.wire.rcs.v1 import job_pb2, options_pb2

Vector = Tuple[float, float, float]
PathLike = Union[str, "os.PathLike[str]"]


@dataclasses.dataclass(frozen=True)
class View:
    """A camera beside the scene's: where it stands [m], what it looks at, its vertical field of view [degrees]."""

    eye: Vector
    target: Vector
    up: Vector = (0.0, 1.0, 0.0)
    fov: float = 45.0


@dataclasses.dataclass(frozen=True)
class Output:
    """A picture file that each frame makes: .exr, .png or .jpg by its name.

    layers: of an EXR, beside beauty; empty: the default ones. pixel_format: half, float, 8 or 16 (bits); None: half in
    EXR, 8 in PNG and JPEG.
    """

    name: str
    layers: Sequence[str] = ()
    pixel_format: Optional[str] = None
    jpeg_quality: Optional[int] = None


class JobOptions(RenderOptions, total=False):
    """Options of submit(), beside those of RenderOptions."""

    camera: Union[str, View]
    """The scene's, by name or by its number from 0 as text; or one beside it. Default: the scene's first."""
    lens_shift: Tuple[float, float]
    """To the right and up, in heights of the picture."""
    time: float
    """Pose of the scene's animations [s]; default: the rest pose."""
    animation: str
    """The scene's animation that poses it, by name or by number; default: all."""
    frames: Sequence[Union[int, job_pb2.Frame]]
    """A picture for each: numbers, which show the scene at number / fps, or whole frames."""
    fps: float
    """Default 24."""
    shutter: float
    """Motion blur: part of the time from frame to frame that is seen, around the frame's own, in [0, 1]."""
    camera_path: options_pb2.CameraPath
    """A camera that moves, in place of camera."""
    environment: Union[str, Vector, "os.PathLike[str]"]
    """scene (the default), none, a constant radiance, or a latitude-longitude image."""
    environment_rotation: float
    """Of the image about the vertical, counter-clockwise seen from above [degrees]."""
    motion_time: float
    """That the layer motion tells of [s]."""
    motion_camera: str
    """That the layer motion tells of."""
    outputs: Sequence[Union[str, Output]]
    """Default: image.png."""
    exposure: float
    """Of PNG and JPEG [EV]; default: brings the average to middle grey."""
    ocio: PathLike
    """OpenColorIO configuration in one file; default: the built-in one."""
    display: str
    view: str
    priority: int
    """In [-100, 100], larger comes first."""
    idempotency_key: str
    """Submitted again with the same key, it stays one job."""
    labels: Mapping[str, str]
    time_limit: float
    """Wall time of a frame [s]; default: the server's."""
    after: Sequence[int]
    """Jobs that have to be completed before this one starts."""
    stop_after: int
    """So many frames that fail with one reason end the job; 0, the default: never."""
    deliver: str
    """Folder on the server, beneath what it allows, that pictures are copied to as they finish."""
    on_server: bool
    """The scene is a path on the server."""


_QUALITY = options_pb2.RenderOptions.DESCRIPTOR.oneofs_by_name["quality"]
_PIXEL_FORMATS = {
    "half": options_pb2.PIXEL_FORMAT_HALF,
    "float": options_pb2.PIXEL_FORMAT_FLOAT,
    "8": options_pb2.PIXEL_FORMAT_UINT8,
    "16": options_pb2.PIXEL_FORMAT_UINT16,
}


def _refusal(message: str) -> RenderError:
    return error_of(job_pb2.ERROR_CODE_BAD_ARGUMENT, message)


def _fields_in(field: Any) -> Set[str]:
    return set(field.message_type.fields_by_name) if field.message_type else set()


def render_options(options: Mapping[str, Any]) -> options_pb2.RenderOptions:
    """The message with these fields, wherever within it they lie."""
    message = options_pb2.RenderOptions()
    kinds = {field.name for field in _QUALITY.fields if field.name in options or _fields_in(field) & options.keys()}
    if len(kinds) > 1:
        names = [field.name for field in _QUALITY.fields]
        mixed = " and ".join(name for name in names if name in kinds)
        raise _refusal(f"quality is {mixed}, expected one of {', '.join(names)}")
    for name, value in options.items():
        holder: Any = message
        if name not in message.DESCRIPTOR.fields_by_name:
            within = [field.name for field in _QUALITY.fields if name in _fields_in(field)]
            if not within:
                raise _refusal(f"there is no option {name}; docs/options.md lists them")
            holder = getattr(message, within[0])
        if name in CHOICES:
            if value not in CHOICES[name]:
                raise _refusal(f"{name} is {value}, expected one of {', '.join(CHOICES[name])}")
            value = CHOICES[name].index(value)
        holder.MergeFrom(type(holder)(**{name: value}))
    return message


def _difference(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _unit(v: Vector, what: str) -> Vector:
    length = math.sqrt(sum(x * x for x in v))
    if not 0.0 < length < math.inf:
        raise _refusal(what)
    return (v[0] / length, v[1] / length, v[2] / length)


def _camera(view: View) -> options_pb2.Camera:
    back = _unit(_difference(view.eye, view.target), "the view's eye is its target")
    right = _unit(_cross(view.up, back), "the view looks along its up")
    columns = (right, _cross(back, right), back)
    matrix = [x for column in columns for x in (*column, 0.0)] + [*view.eye, 1.0]
    return options_pb2.Camera(name="given", world_from_view=matrix, yfov=math.radians(view.fov))


def _output(output: Union[str, Output]) -> options_pb2.Output:
    if isinstance(output, str):
        return options_pb2.Output(name=output)
    message = options_pb2.Output(name=output.name, layers=output.layers)
    if output.pixel_format is not None:
        if output.pixel_format not in _PIXEL_FORMATS:
            raise _refusal(f"pixel_format is {output.pixel_format}, expected one of {', '.join(_PIXEL_FORMATS)}")
        message.pixel_format = _PIXEL_FORMATS[output.pixel_format]
    if output.jpeg_quality is not None:
        message.jpeg_quality = output.jpeg_quality
    return message


def _frame(options: JobOptions, number: int, time: Optional[float]) -> job_pb2.Frame:
    frame = job_pb2.Frame(number=number)
    camera = options.get("camera")
    if isinstance(camera, View):
        frame.camera_given.CopyFrom(_camera(camera))
    elif camera is not None:
        frame.camera_name = camera
    if time is not None:
        frame.time = time
    if "lens_shift" in options:
        frame.lens_shift.right, frame.lens_shift.up = options["lens_shift"]
    if "motion_time" in options:
        frame.motion.time = options["motion_time"]
    if "motion_camera" in options:
        frame.motion.camera_name = options["motion_camera"]
    return frame


def _frames(options: JobOptions) -> Iterator[job_pb2.Frame]:
    if "frames" not in options:
        yield _frame(options, 0, options.get("time"))
    for frame in options.get("frames", ()):
        if isinstance(frame, job_pb2.Frame):
            yield frame
        else:
            yield _frame(options, frame, frame / options.get("fps", 24.0))


def _set_environment(job: job_pb2.Job, options: JobOptions) -> None:
    environment = options.get("environment", "scene")
    job.environment.rotation_degrees = options.get("environment_rotation", 0.0)
    job.environment.label = str(environment)
    if environment == "none":
        environment = (0.0, 0.0, 0.0)
    if isinstance(environment, tuple):
        job.environment.constant.red, job.environment.constant.green, job.environment.constant.blue = environment
    elif environment != "scene":
        job.environment.image_ending = pathlib.Path(environment).suffix.lower()


def job_files(options: JobOptions) -> Dict[str, pathlib.Path]:
    """What is to be uploaded beside the scene: "environment" and "ocio"."""
    files: Dict[str, pathlib.Path] = {}
    environment = options.get("environment", "scene")
    if not isinstance(environment, tuple) and environment not in ("scene", "none"):
        files["environment"] = pathlib.Path(environment)
    if "ocio" in options:
        files["ocio"] = pathlib.Path(options["ocio"])
    return files


def job_message(options: JobOptions, uploads: Mapping[str, options_pb2.Blob]) -> job_pb2.Job:
    """All but its scene. uploads: of job_files()."""
    others = JobOptions.__annotations__.keys() - RenderOptions.__annotations__.keys()
    job = job_pb2.Job(
        options=render_options({name: value for name, value in options.items() if name not in others}),
        outputs=[_output(output) for output in options.get("outputs", ("image.png",))],
        frames=list(_frames(options)),
        priority=options.get("priority", 0),
        idempotency_key=options.get("idempotency_key", ""),
        labels=dict(options.get("labels", {})),
        time_limit_seconds=options.get("time_limit", 0.0),
        after=options.get("after", ()),
        stop_after=options.get("stop_after", 0),
        deliver=options.get("deliver", ""),
        camera_path=options.get("camera_path"),
        shutter_seconds=options.get("shutter", 0.0) / options.get("fps", 24.0),
    )
    job.scene.animation = options.get("animation", "")
    _set_environment(job, options)
    if "environment" in uploads:
        job.environment.image.CopyFrom(uploads["environment"])
    if "ocio" in uploads:
        job.tone_map.ocio_config.CopyFrom(uploads["ocio"])
    if "exposure" in options:
        job.tone_map.exposure = options["exposure"]
    job.tone_map.display, job.tone_map.view = options.get("display", ""), options.get("view", "")
    return job


def option_names() -> List[str]:
    """All that submit() takes."""
    return sorted(JobOptions.__annotations__)

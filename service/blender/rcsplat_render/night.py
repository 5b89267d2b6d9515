"""Frames of the timeline as jobs of the server's queue, and their pictures, also after Blender was closed meanwhile."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import shutil
import tempfile
from concurrent.futures import Future
from typing import Any, Dict, List, Optional, Tuple

import bpy
from rcsplat import job_pb2
from rcsplat.job_options import JobOptions

from . import jobs, pictures, settings
from .cameras import seen_through
from .link import LINK, Place, one_line
from .snapshot import Snapshot, take

Placed = Dict[int, Tuple[int, str]]  # frames: the job, and where the picture goes
LAYERS = ["emission", "direct", "indirect", "albedo", "normal", "depth"]
MOST_FRAMES = 500  # of a job, that one answer tells of
ENDED = (job_pb2.JOB_STATE_CANCELLED, job_pb2.JOB_STATE_COMPLETED, job_pb2.JOB_STATE_COMPLETED_WITH_WARNINGS,
         job_pb2.JOB_STATE_FAILED)


@dataclasses.dataclass
class Night:
    """What was queued together; kept in a file, so that another Blender finds it."""

    place: Dict[str, Any]
    frames: Placed
    fetched: List[int] = dataclasses.field(default_factory=list)


def _file() -> pathlib.Path:
    return pathlib.Path(bpy.utils.user_resource("CONFIG")) / "rcsplat" / "queue.json"


def nights() -> List[Night]:
    try:
        kept = json.loads(_file().read_text())
    except FileNotFoundError:
        return []
    return [Night(n["place"], {int(k): (v[0], v[1]) for k, v in n["frames"].items()}, n["fetched"]) for n in kept]


def keep(found: List[Night]) -> None:
    path = _file()
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_text(json.dumps([dataclasses.asdict(night) for night in found]))
    temporary.replace(path)


@dataclasses.dataclass
class Batch:
    """Frames that show one scene: a job."""

    snapshot: Snapshot
    options: Dict[str, Any]
    frames: List[job_pb2.Frame]
    paths: List[str]

    def takes(self, snapshot: Snapshot, options: Dict[str, Any]) -> bool:
        return len(self.frames) < MOST_FRAMES and self.snapshot.same_as(snapshot) and self.options == options


class Collector:
    """Takes the frames, one a call, so that Blender's window lives. Belongs to the main thread."""

    def __init__(self, scene: Any) -> None:
        self.scene = scene
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="rcsplat-night-"))
        self.left = list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
        self.count = len(self.left)
        self.batches: List[Batch] = []
        self.warnings: List[str] = []
        self._current = scene.frame_current

    def step(self) -> bool:
        """Whether there are more."""
        scene, number = self.scene, self.left.pop(0)
        scene.frame_set(number)
        if scene.camera is None:
            raise ValueError(f"frame {number} has no camera")
        depsgraph = bpy.context.evaluated_depsgraph_get()
        framing = jobs.framing_of(scene.render)
        seen = seen_through(scene.camera.evaluated_get(depsgraph), scene.render, framing.size)
        snapshot = take(depsgraph, self.folder, True, scene.rcsplat.soft_lamps)
        options = jobs.job_options(scene, framing, seen, snapshot)
        if not self.batches or not self.batches[-1].takes(snapshot, options):
            self.batches.append(Batch(snapshot, options, [], []))
        self.batches[-1].frames.append(jobs.frame_of(number, seen.camera))
        self.batches[-1].paths.append(bpy.path.abspath(scene.render.frame_path(frame=number)))
        self.warnings += [line for line in seen.warnings + snapshot.warnings if line not in self.warnings]
        return bool(self.left)

    def finish(self) -> None:
        self.scene.frame_set(self._current)

    def remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)


async def _submit(place: Place, batches: List[Batch], labels: Dict[str, str], priority: int) -> Placed:
    client = await LINK.client(place)
    frames: Placed = {}
    output = jobs.output(LAYERS)
    for batch in batches:
        options = JobOptions(frames=batch.frames, outputs=[output], labels=labels, priority=priority,
                             **batch.options)  # type: ignore[typeddict-item]
        job = await client.submit(batch.snapshot.scene, **options)
        frames.update({f.number: (job.number, path) for f, path in zip(batch.frames, batch.paths)})
    return frames


def submit(collector: Collector) -> "Future[Placed]":
    labels = {"client": "blender", "kind": "queue", "scene": collector.scene.name[:60],
              "file": pathlib.Path(bpy.data.filepath or "unsaved").name[:100]}
    return LINK.run(_submit(settings.place(), collector.batches, labels, collector.scene.rcsplat.priority))


@dataclasses.dataclass
class State:
    """Of all that was queued, as the panel shows it."""

    line: str = ""
    pictures: List[Tuple[int, int, str, bytes]] = dataclasses.field(default_factory=list)  # night, frame, path, EXR
    failures: List[str] = dataclasses.field(default_factory=list)
    ended: bool = False


async def _look(found: List[Night], most: int) -> State:
    """How far it is, and up to so many pictures that are there and were not fetched."""
    state, done, wanted = State(), 0, 0
    open_jobs = 0
    for index, night in enumerate(found):
        client = await LINK.client(Place(**night.place))
        numbers: Dict[int, List[int]] = {}
        for frame, (job, _) in night.frames.items():
            numbers.setdefault(job, []).append(frame)
        wanted += len(night.frames)
        done += len(night.fetched)
        for job, frames in numbers.items():
            if set(frames) <= set(night.fetched):
                continue
            details = await client.job(job).details(frames=MOST_FRAMES)
            open_jobs += details.status.state not in ENDED
            for status in details.frames:
                if status.number in night.fetched:
                    continue
                if status.state == job_pb2.FRAME_STATE_FAILED:
                    state.failures.append(f"frame {status.number}: {status.error.message}")
                elif status.state == job_pb2.FRAME_STATE_COMPLETED and len(state.pictures) < most:
                    data = await client.job(job).read("image.exr", status.number)
                    state.pictures.append((index, status.number, night.frames[status.number][1], data))
    state.line = f"{done + len(state.pictures)} of {wanted} frames"
    state.ended = not open_jobs and not state.pictures
    return state


def look(found: List[Night], most: int = 4) -> "Future[State]":
    return LINK.run(_look(found, most))


def store(scene: Any, path: str, data: bytes) -> None:
    """As the scene's output settings say: EXR files as they came, others by Blender's view transform."""
    target = pathlib.Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    if scene.render.image_settings.file_format in ("OPEN_EXR", "OPEN_EXR_MULTILAYER"):
        temporary = target.with_name(f".{target.name}")
        temporary.write_bytes(data)
        temporary.replace(target)
        return
    with tempfile.TemporaryDirectory(prefix="rcsplat-picture-") as name:
        source = pathlib.Path(name) / "picture.exr"
        source.write_bytes(pictures.plain(data))
        image = bpy.data.images.load(str(source))
        try:
            image.save_render(str(target), scene=scene)
        finally:
            bpy.data.images.remove(image)


def fetch(scene: Any, found: List[Night], state: State) -> None:
    """Writes what look() brought, and remembers that it did."""
    for index, frame, path, data in state.pictures:
        store(scene, path, data)
        found[index].fetched.append(frame)
    keep([night for night in found if set(night.frames) - set(night.fetched)])


def cancelled(found: List[Night]) -> "Future[None]":
    async def end() -> None:
        for night in found:
            client = await LINK.client(Place(**night.place))
            for job in {job for job, _ in night.frames.values()}:
                await client.job(job).cancel()

    return LINK.run(end())


def said(future: "Future[Any]") -> Optional[str]:
    """What went wrong, in one line."""
    error = future.exception()
    return None if error is None else one_line(error)

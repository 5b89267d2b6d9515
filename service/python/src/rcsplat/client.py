"""Jobs for a render server, and their pictures as numpy arrays."""

from __future__ import annotations

import hashlib
import io
import logging
import os
import pathlib
import time as clock
import uuid
from types import TracebackType
from typing import Any, Iterator, List, Mapping, Optional, Sequence, Set, Tuple, Type, Union

import numpy
import numpy.typing
from PIL import Image

from rcsplat.connection import Connection, ConnectionLost, RenderError, default_address
from rcsplat.scene_files import scene_files
from rcsplat.wire.rcs.v1 import job_pb2, options_pb2, service_pb2

__all__ = ["Client", "ConnectionLost", "Job", "RenderError"]

_ENDED = (
    job_pb2.JOB_STATE_CANCELLED,
    job_pb2.JOB_STATE_COMPLETED,
    job_pb2.JOB_STATE_COMPLETED_WITH_WARNINGS,
    job_pb2.JOB_STATE_FAILED,
)


_LOG = logging.getLogger("rcsplat")
_QUALITY = options_pb2.RenderOptions.DESCRIPTOR.oneofs_by_name["quality"]


def _blob(path: pathlib.Path) -> options_pb2.Blob:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        for block in iter(lambda: file.read(1 << 20), b""):
            digest.update(block)
    return options_pb2.Blob(sha256=digest.digest(), size=path.stat().st_size)


def _render_options(options: Mapping[str, Any]) -> options_pb2.RenderOptions:
    """The message with these fields, wherever within it they lie."""
    message = options_pb2.RenderOptions()
    kinds = {field.name for field in _QUALITY.fields if field.name in options or _fields_in(field) & options.keys()}
    if len(kinds) > 1:
        names = [field.name for field in _QUALITY.fields]
        mixed = " and ".join(name for name in names if name in kinds)
        raise _refusal(f"quality is {mixed}, expected one of {', '.join(names)}")
    for name, value in options.items():
        holder = message
        if name not in message.DESCRIPTOR.fields_by_name:
            within = [field.name for field in _QUALITY.fields if name in _fields_in(field)]
            if not within:
                raise _refusal(f"there is no option {name}; docs/options.md lists them")
            holder = getattr(message, within[0])
        holder.MergeFrom(type(holder)(**{name: value}))
    return message


def _fields_in(field: Any) -> Set[str]:
    return set(field.message_type.fields_by_name) if field.message_type else set()


def _refusal(message: str) -> RenderError:
    return RenderError(job_pb2.ERROR_CODE_BAD_ARGUMENT, message)


class Client:
    """A connection to `rcsplat serve`. Not for several threads at a time.

    address: path of a Unix socket, or HOST:PORT; by default $RCSPLAT_SERVER or the socket that a server takes by
    itself.
    token: of a server on TCP. ca, certificate, key: PEM files for TLS, which is spoken beyond loopback or where they
    are given.
    patience: how long to look for a server that went away while something was asked of it [s]. What can be asked twice
    is asked again, and a job stays one: waiting outlives a restart of the server. The logger "rcsplat" says so.
    """

    def __init__(
        self,
        address: Optional[str] = None,
        *,
        token: str = "",
        ca: Optional[str] = None,
        certificate: Optional[str] = None,
        key: Optional[str] = None,
        timeout: float = 120.0,
        patience: float = 600.0,
    ) -> None:
        self._timeout = timeout
        self._patience = patience
        self._next_id = 1
        self._hello = service_pb2.HelloRequest(client="rcsplat python", token=token.encode())
        self._connect = lambda: Connection(address or default_address(), ca, certificate, key, timeout)
        self._begin()

    def _begin(self) -> None:
        self._connection = self._connect()
        self.server = self._call_once(service_pb2.Request(hello=self._hello)).hello

    def _come_back(self, lost: ConnectionLost) -> None:
        """Returns with a new connection. Raises ConnectionLost when patience is at an end."""
        if self._patience <= 0:
            raise lost
        self._connection.close()
        _LOG.warning("the server has gone (%s); looking for it until it is back", lost)
        until, pause = clock.monotonic() + self._patience, 0.25
        while True:
            clock.sleep(pause)
            pause = min(2 * pause, 5.0)
            try:
                self._begin()
                _LOG.warning("the server is back")
                return
            except ConnectionLost:
                if clock.monotonic() >= until:
                    raise

    def __enter__(self) -> "Client":
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        self._connection.close()

    def call(self, request: service_pb2.Request) -> service_pb2.Response:
        """One request, one answer. Raises RenderError."""
        while True:
            try:
                return self._call_once(request)
            except ConnectionLost as lost:
                if request.HasField("submit") and not request.submit.job.idempotency_key:
                    raise
                self._come_back(lost)

    def _call_once(self, request: service_pb2.Request) -> service_pb2.Response:
        request.id = self._next_id
        self._next_id += 1
        self._connection.send(request)
        while True:
            response = self._connection.receive()
            if response.id == request.id:
                return response

    def upload(self, path: Union[str, "os.PathLike[str]"]) -> options_pb2.Blob:
        """Uploads a file unless the server has it, going on where an earlier upload ended."""
        file_path = pathlib.Path(path)
        blob = _blob(file_path)
        ask = service_pb2.BlobStatusRequest(blobs=[blob])
        held = self.call(service_pb2.Request(blob_status=ask)).blob_status.held[0]
        with file_path.open("rb") as file:
            while held < blob.size or blob.size == 0:
                file.seek(held)
                put = service_pb2.BlobPutRequest(blob=blob, offset=held, data=file.read(self.server.max_chunk_bytes))
                held = self.call(service_pb2.Request(blob_put=put)).blob_put.held
                if blob.size == 0:
                    break
        return blob

    def submit(
        self,
        scene: Union[str, "os.PathLike[str]"],
        *,
        camera: Optional[str] = None,
        time: Optional[float] = None,
        lens_shift: Optional[Tuple[float, float]] = None,
        outputs: Sequence[str] = ("image.png",),
        exposure: Optional[float] = None,
        frames: Optional[Sequence[job_pb2.Frame]] = None,
        priority: int = 0,
        idempotency_key: str = "",
        labels: Optional[Mapping[str, str]] = None,
        on_server: bool = False,
        **options: Any,
    ) -> "Job":
        """Submits a picture, or one for each of `frames`.

        scene: a .gltf or .glb file, which is uploaded; a built-in one ("demo:cornell"); with on_server a path there.
        lens_shift: to the right and up, in heights of the picture. outputs: file names ending in .png, .jpg or .exr.
        options: those of docs/options.md by name, such as bounces=2, error_tolerance=0.1 or target_error=0.05.
        """
        job = job_pb2.Job(
            options=_render_options(options),
            outputs=[options_pb2.Output(name=name) for name in outputs],
            priority=priority,
            idempotency_key=idempotency_key or f"once-{uuid.uuid4().hex}",
            labels=dict(labels or {}),
        )
        self._set_scene(job.scene, str(scene), on_server)
        if exposure is not None:
            job.tone_map.exposure = exposure
        if frames is not None:
            job.frames.extend(frames)
        else:
            frame = job.frames.add()
            if camera is not None:
                frame.camera_name = camera
            if time is not None:
                frame.time = time
            if lens_shift is not None:
                frame.lens_shift.right, frame.lens_shift.up = lens_shift
        reply = self.call(service_pb2.Request(submit=service_pb2.SubmitRequest(job=job))).submit
        return Job(self, reply.job)

    def jobs(self, limit: int = 100) -> List[job_pb2.JobStatus]:
        """The newest first."""
        return list(self.call(service_pb2.Request(list=service_pb2.ListRequest(limit=limit))).list.jobs)

    def job(self, number: int) -> "Job":
        return Job(self, number)

    def health(self) -> service_pb2.HealthReply:
        return self.call(service_pb2.Request(health=service_pb2.HealthRequest())).health

    def _set_scene(self, scene: job_pb2.Scene, source: str, on_server: bool) -> None:
        scene.label = source
        if source.startswith("demo:"):
            scene.builtin = source
        elif on_server:
            scene.path = source
        else:
            path = pathlib.Path(source)
            for name in scene_files(path):
                scene.files.files.add(path=name, content=self.upload(path.parent / name))

    def _watch(self, number: int) -> Iterator[job_pb2.JobStatus]:
        request = service_pb2.Request(watch=service_pb2.WatchRequest(job=number))
        asked = False
        while True:
            try:
                if not asked:
                    request.id = self._next_id
                    self._next_id += 1
                    self._connection.send(request)
                    asked = True
                self._connection.set_timeout(None)  # a frame may take long
                try:
                    response = self._connection.receive()
                finally:
                    self._connection.set_timeout(self._timeout)
            except ConnectionLost as lost:
                self._come_back(lost)
                asked = False
                continue
            if response.id != request.id:
                continue
            yield response.watch.status
            if response.watch.last:
                return


class Job:
    """A job that the server has on disk."""

    def __init__(self, client: Client, number: int) -> None:
        self._client = client
        self.number = number

    def progress(self) -> Iterator[job_pb2.JobStatus]:
        """The job's state whenever it changes, until it has ended. Raises RenderError if it failed."""
        for status in self._client._watch(self.number):
            yield status
            if status.state in (job_pb2.JOB_STATE_FAILED, job_pb2.JOB_STATE_CANCELLED):
                message = status.error.message or f"job {self.number} was cancelled"
                raise RenderError(status.error.code or job_pb2.ERROR_CODE_CANCELLED, message)

    def wait(self) -> job_pb2.JobStatus:
        """Its last state. Raises RenderError if it failed."""
        status = job_pb2.JobStatus()
        for status in self.progress():
            pass
        return status

    def cancel(self) -> int:
        """Its state after it."""
        return self._client.call(service_pb2.Request(cancel=service_pb2.CancelRequest(job=self.number))).cancel.state

    def details(self, first_frame: int = 0, frames: int = 10) -> service_pb2.JobReply:
        request = service_pb2.JobRequest(job=self.number, first_frame=first_frame, frames=frames)
        return self._client.call(service_pb2.Request(job=request)).job

    def read(self, name: str = "image.png", frame: int = 0) -> bytes:
        """A picture file's bytes, verified. Waits for nothing."""
        data = bytearray()
        while True:
            request = service_pb2.FetchRequest(job=self.number, frame=frame, name=name, offset=len(data))
            part = self._client.call(service_pb2.Request(fetch=request)).fetch
            data += part.data
            if len(data) >= part.file.size:
                break
            if not part.data:
                raise RenderError(job_pb2.ERROR_CODE_IO, f"the server sent less of {name} than there is")
        if hashlib.sha256(data).digest() != part.file.sha256:
            raise RenderError(job_pb2.ERROR_CODE_BAD_FILE, f"what arrived of {name} is not what was rendered")
        return bytes(data)

    def save(self, name: str, path: Union[str, "os.PathLike[str]"], frame: int = 0) -> None:
        """Writes a picture file, which appears under `path` only when it is complete."""
        target = pathlib.Path(path)
        temporary = target.with_name(f".{target.name}.tmp-{os.getpid()}")
        try:
            temporary.write_bytes(self.read(name, frame))
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)

    def image(self, name: str = "image.png", frame: int = 0) -> "numpy.typing.NDArray[numpy.uint8]":
        """A PNG or JPEG of 8 bits as height x width x 3. Waits until the job has ended."""
        if self.details(frames=1).status.state not in _ENDED:
            self.wait()
        if not name.endswith((".png", ".jpg", ".jpeg")):
            raise ValueError(f"{name} is no PNG or JPEG; read() gives its bytes")
        return numpy.asarray(Image.open(io.BytesIO(self.read(name, frame))).convert("RGB"))

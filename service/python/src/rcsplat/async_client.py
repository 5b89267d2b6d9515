"""Jobs for a render server, and their pictures as numpy arrays: for asyncio."""

from __future__ import annotations

import asyncio
import hashlib
import io
import logging
import os
import pathlib
import time as clock
import uuid
from types import TracebackType
from typing import TYPE_CHECKING, AsyncGenerator, AsyncIterator, Awaitable, Callable, Dict, List, Optional, Type, Union

import numpy
import numpy.typing

from rcsplat.connection import Connection, default_address
from rcsplat.errors import ConnectionLost, RenderError, error_of
from rcsplat.job_options import JobOptions, PathLike, job_files, job_message
from rcsplat.scene_files import scene_files
from rcsplat.wire.rcs.v1 import job_pb2, options_pb2, service_pb2

if TYPE_CHECKING:
    from typing_extensions import Unpack

_ENDED = (
    job_pb2.JOB_STATE_CANCELLED,
    job_pb2.JOB_STATE_COMPLETED,
    job_pb2.JOB_STATE_COMPLETED_WITH_WARNINGS,
    job_pb2.JOB_STATE_FAILED,
)
_LOG = logging.getLogger("rcsplat")

Answers = Dict[int, "asyncio.Queue[Union[service_pb2.Response, RenderError]]"]


def _blob(path: pathlib.Path) -> options_pb2.Blob:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        for block in iter(lambda: file.read(1 << 20), b""):
            digest.update(block)
    return options_pb2.Blob(sha256=digest.digest(), size=path.stat().st_size)


class AsyncClient:
    """A connection to `rcsplat serve`, for one event loop; any number of tasks may wait on it at a time.

    address: path of a Unix socket, or HOST:PORT; by default $RCSPLAT_SERVER or the socket that a server takes by
    itself.
    token: of a server on TCP. ca, certificate, key: PEM files for TLS, which is spoken beyond loopback or where they
    are given.
    timeout: for an answer [s]. patience: how long to look for a server that went away while something was asked of it
    [s]. What can be asked twice is asked again, and a job stays one: waiting outlives a restart of the server. The
    logger "rcsplat" says so.

        async with AsyncClient() as client:
            job = await client.submit("demo:cornell", width=200, height=200)
            image = await job.image()
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
        self.server = service_pb2.HelloReply()
        self._timeout = timeout
        self._patience = patience
        self._next_id = 1
        self._hello = service_pb2.HelloRequest(client="rcsplat python", token=token.encode())
        self._open: Callable[[], Awaitable[Connection]] = lambda: Connection.open(
            address or default_address(), ca, certificate, key, timeout
        )
        self._connection: Optional[Connection] = None
        self._answers: Answers = {}
        self._listener: Optional["asyncio.Task[None]"] = None
        self._age = 0  # how often it has connected
        self._coming_back: Optional[asyncio.Lock] = None

    async def __aenter__(self) -> "AsyncClient":
        await self.connect()
        return self

    async def __aexit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        await self.close()

    async def connect(self) -> None:
        """What entering the client's context does."""
        self._coming_back = self._coming_back or asyncio.Lock()
        self._connection = await self._open()
        self._answers = {}
        self._listener = asyncio.ensure_future(self._listen(self._connection, self._answers))
        self.server = (await self._ask(service_pb2.Request(hello=self._hello))).hello
        self._age += 1

    async def close(self) -> None:
        if self._listener is not None:
            self._listener.cancel()
            await asyncio.gather(self._listener, return_exceptions=True)
        if self._connection is not None:
            self._connection.close()

    async def _listen(self, connection: Connection, answers: Answers) -> None:
        """Hands answers to who asked; the end of the connection to all."""
        try:
            while True:
                response = await connection.receive()
                if response.id in answers:
                    answers[response.id].put_nowait(response)
        except RenderError as error:
            end = error
        except Exception as error:  # what arrives is no message
            end = error_of(job_pb2.ERROR_CODE_PROTOCOL, f"the server sent what cannot be read: {error}")
        for queue in answers.values():
            queue.put_nowait(end)

    async def _stream(
        self, request: service_pb2.Request, timeout: Optional[float] = None
    ) -> AsyncGenerator[service_pb2.Response, None]:
        if self._connection is None or self._listener is None or self._listener.done():
            raise ConnectionLost("the server closed the connection")
        request.id = self._next_id
        self._next_id += 1
        answers, number = self._answers, request.id
        answers[number] = asyncio.Queue()
        try:
            await self._connection.send(request)
            while True:
                try:
                    answer = await asyncio.wait_for(answers[number].get(), timeout)
                except asyncio.TimeoutError:
                    raise ConnectionLost(f"no answer within {timeout:g} s") from None
                if isinstance(answer, RenderError):
                    raise answer
                if answer.WhichOneof("result") == "error":
                    raise error_of(answer.error.code, answer.error.message)
                yield answer
        finally:
            del answers[number]

    async def _ask(self, request: service_pb2.Request) -> service_pb2.Response:
        stream = self._stream(request, self._timeout)
        try:
            return await stream.__anext__()
        finally:
            await stream.aclose()

    async def _come_back(self, lost: ConnectionLost, age: int) -> None:
        """Returns with a new connection. Raises ConnectionLost when patience is at an end."""
        if self._patience <= 0 or self._coming_back is None:
            raise lost
        async with self._coming_back:
            if self._age != age:
                return  # another task has
            _LOG.warning("the server has gone (%s); looking for it until it is back", lost)
            until, pause = clock.monotonic() + self._patience, 0.25
            while True:
                await self.close()
                await asyncio.sleep(pause)
                pause = min(2 * pause, 5.0)
                try:
                    await self.connect()
                    _LOG.warning("the server is back")
                    return
                except ConnectionLost:
                    if clock.monotonic() >= until:
                        raise

    async def call(self, request: service_pb2.Request) -> service_pb2.Response:
        """One request, one answer. Raises RenderError."""
        while True:
            age = self._age
            try:
                return await self._ask(request)
            except ConnectionLost as lost:
                if request.HasField("submit") and not request.submit.job.idempotency_key:
                    raise
                await self._come_back(lost, age)

    async def upload(self, path: PathLike) -> options_pb2.Blob:
        """Uploads a file unless the server has it, going on where an earlier upload ended."""
        file_path = pathlib.Path(path)
        blob = await asyncio.get_running_loop().run_in_executor(None, _blob, file_path)
        ask = service_pb2.BlobStatusRequest(blobs=[blob])
        held = (await self.call(service_pb2.Request(blob_status=ask))).blob_status.held[0]
        with file_path.open("rb") as file:
            while held < blob.size or blob.size == 0:
                file.seek(held)
                put = service_pb2.BlobPutRequest(blob=blob, offset=held, data=file.read(self.server.max_chunk_bytes))
                held = (await self.call(service_pb2.Request(blob_put=put))).blob_put.held
                if blob.size == 0:
                    break
        return blob

    async def submit(self, scene: PathLike, **options: "Unpack[JobOptions]") -> "AsyncJob":
        """Submits a picture, or one for each of `frames`.

        scene: a .gltf or .glb file, which is uploaded; a built-in one ("demo:cornell"); with on_server a path there.
        options: those of JobOptions and of docs/options.md by name, such as bounces=2, error_tolerance=0.1 or
        target_error=0.05.
        """
        uploads = {name: await self.upload(path) for name, path in job_files(options).items()}
        job = job_message(options, uploads)
        job.idempotency_key = job.idempotency_key or f"once-{uuid.uuid4().hex}"
        await self._set_scene(job.scene, str(scene), options.get("on_server", False))
        reply = await self.call(service_pb2.Request(submit=service_pb2.SubmitRequest(job=job)))
        return AsyncJob(self, reply.submit.job)

    async def jobs(self, limit: int = 100) -> List[job_pb2.JobStatus]:
        """The newest first."""
        return list((await self.call(service_pb2.Request(list=service_pb2.ListRequest(limit=limit)))).list.jobs)

    def job(self, number: int) -> "AsyncJob":
        return AsyncJob(self, number)

    async def health(self) -> service_pb2.HealthReply:
        return (await self.call(service_pb2.Request(health=service_pb2.HealthRequest()))).health

    async def _set_scene(self, scene: job_pb2.Scene, source: str, on_server: bool) -> None:
        scene.label = source
        if source.startswith("demo:"):
            scene.builtin = source
        elif on_server:
            scene.path = source
        else:
            path = pathlib.Path(source)
            for name in scene_files(path):
                scene.files.files.add(path=name, content=await self.upload(path.parent / name))

    async def watch(self, number: int) -> AsyncIterator[job_pb2.JobStatus]:
        """A job's state whenever it changes, until it has ended."""
        request = service_pb2.Request(watch=service_pb2.WatchRequest(job=number))
        while True:
            age = self._age
            try:
                async for response in self._stream(request):  # a frame may take long
                    yield response.watch.status
                    if response.watch.last:
                        return
            except ConnectionLost as lost:
                await self._come_back(lost, age)


class AsyncJob:
    """A job that the server has on disk."""

    def __init__(self, client: AsyncClient, number: int) -> None:
        self._client = client
        self.number = number

    async def progress(self) -> AsyncIterator[job_pb2.JobStatus]:
        """The job's state whenever it changes, until it has ended. Raises RenderError if it failed."""
        async for status in self._client.watch(self.number):
            yield status
            if status.state in (job_pb2.JOB_STATE_FAILED, job_pb2.JOB_STATE_CANCELLED):
                message = status.error.message or f"job {self.number} was cancelled"
                raise error_of(status.error.code or job_pb2.ERROR_CODE_CANCELLED, message)

    async def wait(self) -> job_pb2.JobStatus:
        """Its last state. Raises RenderError if it failed."""
        status = job_pb2.JobStatus()
        async for status in self.progress():
            pass
        return status

    async def cancel(self) -> job_pb2.JobState:
        """Its state after it."""
        request = service_pb2.Request(cancel=service_pb2.CancelRequest(job=self.number))
        return (await self._client.call(request)).cancel.state

    async def details(self, first_frame: int = 0, frames: int = 10) -> service_pb2.JobReply:
        request = service_pb2.JobRequest(job=self.number, first_frame=first_frame, frames=frames)
        return (await self._client.call(service_pb2.Request(job=request))).job

    async def read(self, name: str = "image.png", frame: int = 0) -> bytes:
        """A picture file's bytes, verified. Waits for nothing."""
        data = bytearray()
        while True:
            request = service_pb2.FetchRequest(job=self.number, frame=frame, name=name, offset=len(data))
            part = (await self._client.call(service_pb2.Request(fetch=request))).fetch
            data += part.data
            if len(data) >= part.file.size:
                break
            if not part.data:
                raise error_of(job_pb2.ERROR_CODE_IO, f"the server sent less of {name} than there is")
        if hashlib.sha256(data).digest() != part.file.sha256:
            raise error_of(job_pb2.ERROR_CODE_BAD_FILE, f"what arrived of {name} is not what was rendered")
        return bytes(data)

    async def save(self, name: str, path: PathLike, frame: int = 0) -> None:
        """Writes a picture file, which appears under `path` only when it is complete."""
        target = pathlib.Path(path)
        temporary = target.with_name(f".{target.name}.tmp-{os.getpid()}")
        try:
            temporary.write_bytes(await self.read(name, frame))
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)

    async def image(self, name: str = "image.png", frame: int = 0) -> "numpy.typing.NDArray[numpy.uint8]":
        """A PNG or JPEG of 8 bits as height x width x 3. Waits until the job has ended."""
        if not name.endswith((".png", ".jpg", ".jpeg")):
            raise ValueError(f"{name} is no PNG or JPEG; read() gives its bytes")
        if (await self.details(frames=1)).status.state not in _ENDED:
            await self.wait()
        from PIL import Image  # programs that show pictures by other means may lack it

        picture = Image.open(io.BytesIO(await self.read(name, frame))).convert("RGB")
        return numpy.asarray(picture, dtype=numpy.uint8)

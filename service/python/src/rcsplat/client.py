"""The same for programs without an event loop: each call waits for its answer."""

from __future__ import annotations

import asyncio
import threading
from types import TracebackType
from typing import TYPE_CHECKING, Any, AsyncIterator, Coroutine, Iterator, List, Optional, Type, TypeVar

import numpy
import numpy.typing

from rcsplat.async_client import AsyncClient, AsyncJob
from rcsplat.job_options import JobOptions, PathLike
from rcsplat.wire.rcs.v1 import job_pb2, options_pb2, service_pb2

if TYPE_CHECKING:
    from typing_extensions import Unpack

T = TypeVar("T")


class _Loop:
    """An event loop in a thread of its own, so that it may be used where another one runs (notebooks)."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="rcsplat", daemon=True)
        self._thread.start()

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return future.result()
        except BaseException:  # an interrupt while it waits, too
            future.cancel()
            raise

    def each(self, items: AsyncIterator[T]) -> Iterator[T]:
        async def following() -> T:
            return await items.__anext__()

        while True:
            try:
                yield self.run(following())
            except StopAsyncIteration:
                return

    def stop(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
            self._loop.close()


class Client:
    """A connection to `rcsplat serve`. Arguments are those of AsyncClient."""

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
        self._client = AsyncClient(
            address, token=token, ca=ca, certificate=certificate, key=key, timeout=timeout, patience=patience
        )
        self._loop = _Loop()
        try:
            self._loop.run(self._client.connect())
        except BaseException:
            self._loop.stop()
            raise

    def __enter__(self) -> "Client":
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    @property
    def server(self) -> service_pb2.HelloReply:
        return self._client.server

    def close(self) -> None:
        self._loop.run(self._client.close())
        self._loop.stop()

    def call(self, request: service_pb2.Request) -> service_pb2.Response:
        """One request, one answer. Raises RenderError."""
        return self._loop.run(self._client.call(request))

    def upload(self, path: PathLike) -> options_pb2.Blob:
        """Uploads a file unless the server has it, going on where an earlier upload ended."""
        return self._loop.run(self._client.upload(path))

    def submit(self, scene: PathLike, **options: "Unpack[JobOptions]") -> "Job":
        """As AsyncClient.submit()."""
        return Job(self._loop, self._loop.run(self._client.submit(scene, **options)))

    def jobs(self, limit: int = 100) -> List[job_pb2.JobStatus]:
        """The newest first."""
        return self._loop.run(self._client.jobs(limit))

    def job(self, number: int) -> "Job":
        return Job(self._loop, self._client.job(number))

    def health(self) -> service_pb2.HealthReply:
        return self._loop.run(self._client.health())


class Job:
    """A job that the server has on disk."""

    def __init__(self, loop: _Loop, job: AsyncJob) -> None:
        self._loop = loop
        self._job = job

    @property
    def number(self) -> int:
        return self._job.number

    def progress(self) -> Iterator[job_pb2.JobStatus]:
        """The job's state whenever it changes, until it has ended. Raises RenderError if it failed."""
        return self._loop.each(self._job.progress())

    def wait(self) -> job_pb2.JobStatus:
        """Its last state. Raises RenderError if it failed."""
        return self._loop.run(self._job.wait())

    def cancel(self) -> job_pb2.JobState:
        """Its state after it."""
        return self._loop.run(self._job.cancel())

    def details(self, first_frame: int = 0, frames: int = 10) -> service_pb2.JobReply:
        return self._loop.run(self._job.details(first_frame, frames))

    def read(self, name: str = "image.png", frame: int = 0) -> bytes:
        """A picture file's bytes, verified. Waits for nothing."""
        return self._loop.run(self._job.read(name, frame))

    def save(self, name: str, path: PathLike, frame: int = 0) -> None:
        """Writes a picture file, which appears under `path` only when it is complete."""
        self._loop.run(self._job.save(name, path, frame))

    def image(self, name: str = "image.png", frame: int = 0) -> "numpy.typing.NDArray[numpy.uint8]":
        """A PNG or JPEG of 8 bits as height x width x 3. Waits until the job has ended."""
        return self._loop.run(self._job.image(name, frame))

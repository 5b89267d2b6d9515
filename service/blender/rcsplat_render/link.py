"""Renders on the server, from a thread of its own that never calls Blender: who asks looks at a ticket now and then."""

from __future__ import annotations

import asyncio
import dataclasses
import json
import logging
import pathlib
import threading
import time
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any, Coroutine, Dict, List, Optional

from rcsplat import AsyncClient, ConnectionLost, RenderError, service_pb2

from .server import SERVER

_LOG = logging.getLogger("rcsplat")
PATIENCE = 4.0  # for a server that went away [s]


@dataclasses.dataclass(frozen=True)
class Place:
    """Where the server is, as the preferences say."""

    address: str = ""
    token: str = ""
    program: str = ""
    may_start: bool = True


@dataclasses.dataclass
class Ticket:
    """How far a render is. Written by the link's thread, read by Blender's."""

    job: int = 0
    stage: str = "connects"
    fraction: float = 0.0
    eta: Optional[float] = None
    forecast: Optional[float] = None  # of the whole picture [s], as the server says before it begins
    error: Optional[float] = None  # that the picture is estimated to have
    sent: int = 0  # bytes of files that the server did not have
    waited: Optional[float] = None  # from asking until somebody works on it [s]
    done: bool = False
    failure: str = ""
    warnings: List[str] = dataclasses.field(default_factory=list)
    stats: Dict[str, Any] = dataclasses.field(default_factory=dict)
    data: bytes = b""


class CountingClient(AsyncClient):
    """Knows how much it has uploaded."""

    sent = 0

    async def call(self, request: service_pb2.Request) -> service_pb2.Response:
        self.sent += len(request.blob_put.data)
        return await super().call(request)


def one_line(error: BaseException) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text if isinstance(error, (RenderError, OSError, ValueError)) else f"{type(error).__name__}: {text}"


class Link:
    """A loop in a thread, and a connection for each place."""

    def __init__(self) -> None:
        self._loop: Optional[asyncio.AbstractEventLoop] = None
        self._thread: Optional[threading.Thread] = None
        self._clients: Dict[Place, CountingClient] = {}
        # Nobody waits for them any more since their server went away: the next one would begin them anew.
        self.abandoned: Dict[Place, List[int]] = {}

    def run(self, work: Coroutine[Any, Any, Any]) -> "Future[Any]":
        if self._loop is None:
            self._loop = asyncio.new_event_loop()
            self._thread = threading.Thread(target=self._loop.run_forever, name="rcsplat", daemon=True)
            self._thread.start()
        return asyncio.run_coroutine_threadsafe(work, self._loop)

    async def client(self, place: Place) -> CountingClient:
        """One that is connected; the server is started where the place says so."""
        client = self._clients.get(place)
        if client is not None:
            try:
                await client.health()
                return client
            except RenderError:
                await client.close()
                del self._clients[place]
        loop = asyncio.get_running_loop()
        address = await loop.run_in_executor(None, SERVER.ensure, place.address, place.program, place.may_start)
        client = CountingClient(address, token=place.token, patience=PATIENCE)
        await client.connect()
        self._clients[place] = client
        for number in self.abandoned.pop(place, []):
            try:
                await client.job(number).cancel()
            except RenderError as error:
                _LOG.debug("cancelling job %d: %s", number, error)
        return client

    def render(self, place: Place, scene: pathlib.Path, options: Dict[str, Any]) -> "Rendering":
        """One picture, an EXR that is called image.exr."""
        return Rendering(self, place, scene, options)

    def forecast(self, place: Place, scene: pathlib.Path, options: Dict[str, Any]) -> "Rendering":
        """What a picture will take, in the ticket's `forecast`: the job ends as soon as the server has told.

        Where the picture is done before, its stats."""
        return Rendering(self, place, scene, options, forecast_alone=True)

    def stop(self) -> None:
        if self._loop is None or self._thread is None:
            return

        async def close() -> None:
            under_way = asyncio.all_tasks() - {asyncio.current_task()}
            for task in under_way:
                task.cancel()
            await asyncio.gather(*under_way, return_exceptions=True)
            for client in self._clients.values():
                await client.close()
            self._clients.clear()

        try:
            self.run(close()).result(5.0)
        except Exception as error:  # it ends in any case
            _LOG.debug("closing: %s", error)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(5.0)
        self._loop = self._thread = None


class Rendering:
    """A ticket that is worked on."""

    def __init__(self, link: Link, place: Place, scene: pathlib.Path, options: Dict[str, Any],
                 forecast_alone: bool = False) -> None:
        self.ticket = Ticket()
        self._forecast_alone = forecast_alone
        self._link, self._place, self._scene, self._options = link, place, scene, options
        self._future = link.run(self._work())

    async def _work(self) -> None:
        ticket, asked = self.ticket, time.monotonic()
        try:
            client = await self._link.client(self._place)
            before, ticket.stage = client.sent, "uploads"
            job = await client.submit(self._scene, **self._options)
            ticket.job, ticket.stage, ticket.sent = job.number, "waits", client.sent - before
            async for status in job.progress():
                for running in status.running:
                    ticket.waited = ticket.waited or time.monotonic() - asked
                    ticket.stage, ticket.fraction = running.stage, running.fraction
                    ticket.eta = running.eta_seconds if running.HasField("eta_seconds") else None
                    ticket.error = running.error_estimate if running.HasField("error_estimate") else None
                    ticket.forecast = running.forecast_seconds if running.HasField("forecast_seconds") else None
                if self._forecast_alone and ticket.forecast is not None:
                    await job.cancel()
                    return
            frame = (await job.details(frames=1)).frames[0]
            ticket.warnings = list(frame.warnings)
            ticket.stats = json.loads(frame.stats_json or "{}")
            ticket.error = frame.error_estimate
            if self._forecast_alone:
                return
            ticket.data = await job.read("image.exr", frame.number)
        except asyncio.CancelledError:
            ticket.failure = "cancelled"
        except Exception as error:  # whatever it is, Blender says it in one line
            ticket.failure = one_line(error)
            if isinstance(error, ConnectionLost) and ticket.job:
                self._link.abandoned.setdefault(self._place, []).append(ticket.job)
        finally:
            ticket.done = True

    def wait(self, seconds: float) -> Ticket:
        """For scripts. What lasts longer is cancelled."""
        try:
            self._future.result(seconds)
        except FutureTimeout:
            self.cancel()
            raise OSError(f"no answer within {seconds:g} s") from None
        return self.ticket

    def cancel(self) -> None:
        """Returns at once; the job ends soon."""

        async def end() -> None:
            client = self._link._clients.get(self._place)
            if client is not None and self.ticket.job and not self.ticket.done:
                try:
                    await asyncio.wait_for(client.job(self.ticket.job).cancel(), 2.0)
                except (RenderError, asyncio.TimeoutError) as error:
                    _LOG.debug("cancelling: %s", error)
            self._future.cancel()

        self._link.run(end())


LINK = Link()

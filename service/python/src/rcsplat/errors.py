"""What can go wrong, by kind. All of it is a RenderError."""

from __future__ import annotations

from typing import Dict, Type

from rcsplat.wire.rcs.v1 import job_pb2


class RenderError(Exception):
    """What the server refused or could not do. `code` is an ErrorCode of job.proto."""

    def __init__(self, code: job_pb2.ErrorCode, message: str) -> None:
        super().__init__(message)
        self.code = code

    @property
    def code_name(self) -> str:
        return job_pb2.ErrorCode.Name(self.code)


class RequestRefused(RenderError):
    """Asked again it is refused again: what was asked has to change."""


class BadArgument(RequestRefused):
    """A value that is none, or out of its range."""


class NotFound(RequestRefused):
    """A job, a frame, a camera or a file that is not there."""


class BadFile(RequestRefused):
    """A scene, a picture or an upload that is none."""


class Unsupported(RequestRefused):
    """Something of a scene or a request that this version does not know."""


class Forbidden(RequestRefused):
    """Outside the server's roots, another owner's, or a server that nobody should talk to."""


class Conflict(RequestRefused):
    """The idempotency key belongs to a different job."""


class LimitReached(RenderError):
    """A limit of the queue, of uploads, connections or sizes."""


class RenderFailed(RenderError):
    """The job failed while it was rendered: memory, time, OpenGL, a worker that died, a job that it waits for."""


class Cancelled(RenderError):
    """The job was cancelled."""


class Unavailable(RenderError):
    """The server is stopping or its disk is full: it may work later."""


class ConnectionLost(Unavailable):
    """The server went away, or was stopped. What was asked of it may have been done."""

    def __init__(self, message: str) -> None:
        super().__init__(job_pb2.ERROR_CODE_UNAVAILABLE, message)


class ProtocolError(RenderError):
    """What answers speaks another language, or another version of it."""


_KINDS: Dict[int, Type[RenderError]] = {
    job_pb2.ERROR_CODE_BAD_ARGUMENT: BadArgument,
    job_pb2.ERROR_CODE_NOT_FOUND: NotFound,
    job_pb2.ERROR_CODE_BAD_FILE: BadFile,
    job_pb2.ERROR_CODE_UNSUPPORTED: Unsupported,
    job_pb2.ERROR_CODE_FORBIDDEN: Forbidden,
    job_pb2.ERROR_CODE_UNAUTHENTICATED: Forbidden,
    job_pb2.ERROR_CODE_CONFLICT: Conflict,
    job_pb2.ERROR_CODE_LIMIT: LimitReached,
    job_pb2.ERROR_CODE_CANCELLED: Cancelled,
    job_pb2.ERROR_CODE_UNAVAILABLE: Unavailable,
    job_pb2.ERROR_CODE_MISSING_BLOBS: Unavailable,
    job_pb2.ERROR_CODE_PROTOCOL: ProtocolError,
    job_pb2.ERROR_CODE_VERSION: ProtocolError,
}


def error_of(code: job_pb2.ErrorCode, message: str) -> RenderError:
    """As the kind that its code says; what has no kind of its own failed while it was rendered."""
    return _KINDS.get(code, RenderFailed)(code, message)

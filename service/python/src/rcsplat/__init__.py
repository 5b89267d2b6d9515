"""Client of rcsplat's render service: see Client and AsyncClient."""

from rcsplat.async_client import AsyncClient, AsyncJob
from rcsplat.client import Client, Job
from rcsplat.errors import (
    BadArgument,
    BadFile,
    Cancelled,
    Conflict,
    ConnectionLost,
    Forbidden,
    LimitReached,
    NotFound,
    ProtocolError,
    RenderError,
    RenderFailed,
    RequestRefused,
    Unavailable,
    Unsupported,
)
from rcsplat.job_options import JobOptions, Output, View
from rcsplat.render_options import RenderOptions
from rcsplat.wire.rcs.v1 import job_pb2, options_pb2, service_pb2

__all__ = [
    "AsyncClient",
    "AsyncJob",
    "BadArgument",
    "BadFile",
    "Cancelled",
    "Client",
    "Conflict",
    "ConnectionLost",
    "Forbidden",
    "Job",
    "JobOptions",
    "LimitReached",
    "NotFound",
    "Output",
    "ProtocolError",
    "RenderError",
    "RenderFailed",
    "RenderOptions",
    "RequestRefused",
    "Unavailable",
    "Unsupported",
    "View",
    "job_pb2",
    "options_pb2",
    "service_pb2",
]

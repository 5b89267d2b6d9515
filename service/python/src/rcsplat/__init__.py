"""Client of rcsplat's render service: see Client."""

from rcsplat.client import Client, Job, RenderError
from rcsplat.wire.rcs.v1 import job_pb2, options_pb2, service_pb2

__all__ = ["Client", "Job", "RenderError", "job_pb2", "options_pb2", "service_pb2"]

"""A connection that speaks proto/rcs/v1/service.proto: greeting, then messages with their length before them."""

from __future__ import annotations

import ipaddress
import os
import socket
import ssl
import struct
from typing import Optional

from rcsplat.wire.rcs.v1 import job_pb2, service_pb2

GREETING = b"RCSP\x00\x02\x00\x00"
MAX_MESSAGE = 1 << 20


class RenderError(Exception):
    """What the server refused or could not do. `code` is an ErrorCode of job.proto."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code

    @property
    def code_name(self) -> str:
        return job_pb2.ErrorCode.Name(self.code)


class ConnectionLost(RenderError):
    """The server went away, or was stopped. What was asked of it may have been done."""

    def __init__(self, message: str) -> None:
        super().__init__(job_pb2.ERROR_CODE_UNAVAILABLE, message)


def default_address() -> str:
    """$RCSPLAT_SERVER, or where rcsplat serve listens unless told."""
    if os.environ.get("RCSPLAT_SERVER"):
        return os.environ["RCSPLAT_SERVER"]
    return own_address()


def own_address() -> str:
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return f"{runtime}/rcsplat/socket" if runtime else f"/tmp/rcsplat-{os.getuid()}/socket"


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _check_owner(path: str, connected: socket.socket) -> None:
    """Nobody may pose as a server: it is this user or root, or, where the address was given, whose folder it is in."""
    _, uid, _ = struct.unpack("3i", connected.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i")))
    if uid in (os.geteuid(), 0):
        return
    folder, owner = os.stat(os.path.dirname(path) or "."), os.stat(path).st_uid
    if folder.st_uid == owner == uid and not folder.st_mode & 0o022 and path != own_address():
        return
    raise RenderError(
        job_pb2.ERROR_CODE_FORBIDDEN,
        f"who answers on {path} is user {uid}, neither this user nor the owner of a folder of its own",
    )


class Connection:
    def __init__(self, address: str, ca: Optional[str], certificate: Optional[str], key: Optional[str],
                 timeout: float) -> None:
        self._buffer = b""
        if "/" in address or ":" not in address:
            self._socket: socket.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            self._socket.settimeout(timeout)
            try:
                self._socket.connect(address)
            except OSError as error:
                raise ConnectionLost(f"no server answers on {address}: {error}") from None
            _check_owner(address, self._socket)
        else:
            host, port = address.rsplit(":", 1)
            host = host.strip("[]")
            try:
                self._socket = socket.create_connection((host, int(port)), timeout)
            except OSError as error:
                raise ConnectionLost(f"no server answers on {address}: {error}") from None
            if not _is_loopback(host) or ca or certificate:
                context = ssl.create_default_context(cafile=ca)
                if certificate:
                    context.load_cert_chain(certificate, key)
                self._socket = context.wrap_socket(self._socket, server_hostname=host)
        self._socket.sendall(GREETING)
        theirs = self._take(len(GREETING))
        if theirs[:6] != GREETING[:6]:
            raise RenderError(job_pb2.ERROR_CODE_VERSION, "what answers is no rcsplat server of protocol version 2")

    def close(self) -> None:
        self._socket.close()

    def set_timeout(self, seconds: Optional[float]) -> None:
        self._socket.settimeout(seconds)

    def send(self, request: service_pb2.Request) -> None:
        message = request.SerializeToString()
        length, prefix = len(message), bytearray()
        while length >= 0x80:
            prefix.append(0x80 | length & 0x7F)
            length >>= 7
        prefix.append(length)
        try:
            self._socket.sendall(bytes(prefix) + message)
        except (BrokenPipeError, ConnectionResetError):
            pass  # what the server said before it closed is still to be read

    def receive(self) -> service_pb2.Response:
        length = shift = 0
        while True:
            byte = self._take(1)[0]
            length |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                break
            if shift > 28:
                raise RenderError(job_pb2.ERROR_CODE_PROTOCOL, "the server sent a length that is none")
        if length > MAX_MESSAGE:
            raise RenderError(job_pb2.ERROR_CODE_PROTOCOL, f"the server announced a message of {length} bytes")
        response = service_pb2.Response.FromString(self._take(length))
        if response.id == 0 and response.error.code == job_pb2.ERROR_CODE_UNAVAILABLE:
            raise ConnectionLost(response.error.message)
        if response.WhichOneof("result") == "error":
            raise RenderError(response.error.code, response.error.message)
        return response

    def _take(self, size: int) -> bytes:
        while len(self._buffer) < size:
            try:
                part = self._socket.recv(1 << 16)
            except ConnectionError as error:
                raise ConnectionLost(f"the connection broke: {error}") from None
            if not part:
                raise ConnectionLost("the server closed the connection")
            self._buffer += part
        taken, self._buffer = self._buffer[:size], self._buffer[size:]
        return taken

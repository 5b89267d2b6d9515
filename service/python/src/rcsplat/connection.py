"""A connection that speaks proto/rcs/v1/service.proto: greeting, then messages with their length before them."""

from __future__ import annotations

import asyncio
import ipaddress
import os
import socket
import ssl
import struct
from typing import Optional

from rcsplat.errors import ConnectionLost, error_of
from rcsplat.wire.rcs.v1 import job_pb2, service_pb2

GREETING = b"RCSP\x00\x02\x00\x00"
MAX_MESSAGE = 1 << 20


def default_address() -> str:
    """$RCSPLAT_SERVER, or where rcsplat serve listens unless told."""
    return os.environ.get("RCSPLAT_SERVER") or own_address()


def own_address() -> str:
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return f"{runtime}/rcsplat/socket" if runtime else f"/tmp/rcsplat-{os.getuid()}/socket"


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _check_owner(path: str, credentials: bytes) -> None:
    """Nobody may pose as a server: it is this user or root, or, where the address was given, whose folder it is in."""
    _, uid, _ = struct.unpack("3i", credentials)
    if uid in (os.geteuid(), 0):
        return
    folder, owner = os.stat(os.path.dirname(path) or "."), os.stat(path).st_uid
    if folder.st_uid == owner == uid and not folder.st_mode & 0o022 and path != own_address():
        return
    raise error_of(
        job_pb2.ERROR_CODE_FORBIDDEN,
        f"who answers on {path} is user {uid}, neither this user nor the owner of a folder of its own",
    )


def _tls(host: str, ca: Optional[str], certificate: Optional[str], key: Optional[str]) -> Optional[ssl.SSLContext]:
    if _is_loopback(host) and not ca and not certificate:
        return None
    context = ssl.create_default_context(cafile=ca)
    if certificate:
        context.load_cert_chain(certificate, key)
    return context


class Connection:
    """Made by open()."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    @classmethod
    async def open(cls, address: str, ca: Optional[str], certificate: Optional[str], key: Optional[str],
                   timeout: float) -> "Connection":
        is_path = "/" in address or ":" not in address
        try:
            if is_path:
                opening = asyncio.open_unix_connection(address)
            else:
                host, port = address.rsplit(":", 1)
                host = host.strip("[]")
                opening = asyncio.open_connection(host, int(port), ssl=_tls(host, ca, certificate, key))
            connection = cls(*await asyncio.wait_for(opening, timeout))
        except (OSError, asyncio.TimeoutError) as error:
            raise ConnectionLost(f"no server answers on {address}: {error}") from None
        try:
            if is_path:
                size = struct.calcsize("3i")
                peer = connection._writer.get_extra_info("socket")
                _check_owner(address, peer.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size))
            connection._writer.write(GREETING)
            theirs = await asyncio.wait_for(connection._take(len(GREETING)), timeout)
            if theirs[:6] != GREETING[:6]:
                raise error_of(job_pb2.ERROR_CODE_VERSION, "what answers is no rcsplat server of protocol version 2")
        except asyncio.TimeoutError:
            connection.close()
            raise ConnectionLost(f"who answers on {address} says nothing") from None
        except BaseException:
            connection.close()
            raise
        return connection

    def close(self) -> None:
        self._writer.close()

    async def send(self, request: service_pb2.Request) -> None:
        message = request.SerializeToString()
        length, prefix = len(message), bytearray()
        while length >= 0x80:
            prefix.append(0x80 | length & 0x7F)
            length >>= 7
        prefix.append(length)
        try:
            self._writer.write(bytes(prefix) + message)
            await self._writer.drain()
        except ConnectionError:
            pass  # what the server said before it closed is still to be read

    async def receive(self) -> service_pb2.Response:
        """Raises RenderError where it says something of the connection, which ends."""
        length = shift = 0
        while True:
            byte = (await self._take(1))[0]
            length |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                break
            if shift > 28:
                raise error_of(job_pb2.ERROR_CODE_PROTOCOL, "the server sent a length that is none")
        if length > MAX_MESSAGE:
            raise error_of(job_pb2.ERROR_CODE_PROTOCOL, f"the server announced a message of {length} bytes")
        response = service_pb2.Response.FromString(await self._take(length))
        if response.id == 0:
            if response.error.code == job_pb2.ERROR_CODE_UNAVAILABLE:
                raise ConnectionLost(response.error.message)
            raise error_of(response.error.code, response.error.message)
        return response

    async def _take(self, size: int) -> bytes:
        try:
            return await self._reader.readexactly(size)
        except asyncio.IncompleteReadError:
            raise ConnectionLost("the server closed the connection") from None
        except ConnectionError as error:
            raise ConnectionLost(f"the connection broke: {error}") from None

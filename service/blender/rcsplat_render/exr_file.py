"""EXR files as far as Blender needs help with them: its Python reads R, G and B alone, so that other channels
are given these names. Pixels stay packed as they are. Layout: openexr.com, "OpenEXR File Layout"."""

from __future__ import annotations

import struct
from typing import Any, Dict, List, NamedTuple, Tuple

MAGIC = b"\x76\x2f\x31\x01"
LINES = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32}  # of a block, by compression

NEEDED = (b"channels", b"compression", b"dataWindow", b"displayWindow", b"lineOrder", b"pixelAspectRatio",
          b"screenWindowCenter", b"screenWindowWidth")


class Attribute(NamedTuple):
    name: bytes
    kind: bytes
    value: bytes


class Header(NamedTuple):
    attributes: List[Attribute]
    size: int  # of the file's part before the table of blocks

    def value(self, name: bytes) -> bytes:
        return next(a.value for a in self.attributes if a.name == name)


def _word(data: bytes, begin: int) -> Tuple[bytes, int]:
    """Up to the next 0, and where it goes on."""
    end = data.index(b"\0", begin)
    return data[begin:end], end + 1


def read_header(data: bytes) -> Header:
    """What is none raises a ValueError."""
    if data[:4] != MAGIC or data[5] & 0x1A:
        raise ValueError("what arrived is no EXR file of one part")
    attributes, at = [], 8
    while data[at]:
        name, at = _word(data, at)
        kind, at = _word(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        attributes.append(Attribute(name, kind, data[at + 4:at + 4 + size]))
        at += 4 + size
    return Header(attributes, at + 1)


def _channels(header: Header) -> List[Tuple[str, bytes]]:
    value, at, found = header.value(b"channels"), 0, []
    while value[at]:
        name, at = _word(value, at)
        found.append((name.decode(), value[at:at + 16]))
        at += 16
    return found


def channel_names(header: Header) -> List[str]:
    return [name for name, _ in _channels(header)]


def texts(header: Header) -> Dict[str, str]:
    return {a.name.decode(): a.value.decode(errors="replace") for a in header.attributes if a.kind == b"string"}


def size_of(header: Header) -> Tuple[int, int]:
    left, top, right, bottom = struct.unpack("<4i", header.value(b"dataWindow"))
    return right - left + 1, bottom - top + 1


def _names(old: List[str], wanted: Dict[str, str]) -> List[str]:
    """New ones in the same order: pixels of a channel lie where its name is in the alphabet."""
    names, last = [], ""
    for number, name in enumerate(old):
        if name in wanted:
            last = wanted[name]
            names.append(last)
        else:
            names.append(f"{last}~{number:04}" if last else f"!{number:04}")
    if names != sorted(names):
        raise ValueError(f"channels {sorted(wanted)} cannot be called {sorted(wanted.values())}")
    return names


def renamed(data: bytes, wanted: Dict[str, str]) -> bytes:
    """The file with new names for these channels, and others for all the rest. The whole is what it holds."""
    header = read_header(data)
    channels = _channels(header)
    names = _names([name for name, _ in channels], wanted)
    parts = [data[:8]]
    for attribute in header.attributes:
        if attribute.name not in NEEDED:
            continue
        value = attribute.value
        if attribute.name == b"channels":
            value = b"".join(n.encode() + b"\0" + rest for n, (_, rest) in zip(names, channels)) + b"\0"
        elif attribute.name == b"displayWindow":
            value = header.value(b"dataWindow")
        parts += [attribute.name, b"\0", attribute.kind, b"\0", struct.pack("<i", len(value)), value]
    head = b"".join(parts) + b"\0"
    height = size_of(header)[1]
    blocks = -(-height // LINES[header.value(b"compression")[0]])
    table = struct.unpack_from(f"<{blocks}Q", data, header.size)
    moved = struct.pack(f"<{blocks}Q", *(place + len(head) - header.size for place in table))
    return head + moved + data[header.size + 8 * blocks:]


def packed(rgb: Any) -> bytes:
    """A file of 32-bit floats, not compressed. @param rgb  height x width x 3, rows from the top"""
    height, width = rgb.shape[:2]
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = [(b"channels", b"chlist", channels), (b"compression", b"compression", b"\0"),
                  (b"dataWindow", b"box2i", window), (b"displayWindow", b"box2i", window),
                  (b"lineOrder", b"lineOrder", b"\0"), (b"pixelAspectRatio", b"float", struct.pack("<f", 1.0)),
                  (b"screenWindowCenter", b"v2f", bytes(8)), (b"screenWindowWidth", b"float", struct.pack("<f", 1.0))]
    head = MAGIC + struct.pack("<i", 2) + b"".join(
        name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value for name, kind, value in attributes) + b"\0"
    line = 12 * width
    begin = len(head) + 8 * height
    table = struct.pack(f"<{height}Q", *(begin + y * (8 + line) for y in range(height)))
    rows = rgb.astype("<f4")[..., ::-1].transpose(0, 2, 1)  # of each row B, then G, then R
    return head + table + b"".join(struct.pack("<ii", y, line) + rows[y].tobytes() for y in range(height))

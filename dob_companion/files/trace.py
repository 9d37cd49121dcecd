"""The trace of a flight: what the companion was told and what it answered, as bytes (docs/recording.md).

A segment is a gzip stream of frames, flushed after each write, so that what was written can be read whatever comes
after. It begins with a HEADER and a CHECKPOINT and can be read alone. A frame is `length u32, CRC-32 u32, payload`,
little-endian, and was handed over at once: it ends with answers that are about to leave, or with a turn of the loop.
Its payload is a sequence of items, `kind u8, length u32, data`.

This module needs the standard library only: the process that writes the files loads nothing else.
"""

import json
import struct
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

SCHEMA = "dob-companion/trace/2"
EARLIER = ("dob-companion/trace/1",)
"""Schemas that are read as well: they have no STANDING and no CHANGED."""

GZIP = 16 + zlib.MAX_WBITS
"""zlib's word for a gzip stream."""

LARGEST_FRAME = 1 << 24
"""Nothing that is handed over is as long; a length beyond is damage."""

_PIECE = 64

_FRAME = struct.Struct("<II")
_ITEM = struct.Struct("<BI")
_TIME = struct.Struct("<d")


class Kind(IntEnum):
    """What an item is. Times are seconds of the daemon's monotonic clock as float64, bit for bit."""

    HEADER = 1
    """JSON object: schema, design, configuration, program"""
    CHECKPOINT = 2
    """JSON object: the companion's state, as its difference from a companion just built"""
    LOST = 3
    """u32: so many turns before this one were not recorded"""
    TIME = 4
    """float64: `now` of the verbs that follow"""
    RECEIVED = 5
    """bytes from the link, one piece"""
    ADVANCED = 6
    """time has passed"""
    CLOSING = 7
    """the companion was told to leave"""
    LOAD = 8
    """JSON list: uptime in ms, memory in use and in all in MiB, as told to the companion"""
    SAID = 9
    """one message that the companion answered to the verb before"""
    TOOK = 10
    """float64: a turn of the loop is over; its wall time in s, from waking to the last byte sent"""
    STANDING = 11
    """JSON object: after each CHECKPOINT, what readers may rely on: system, profile, state, parameters"""
    CHANGED = 12
    """JSON object: the supervisor has changed to this state, for this reason"""


@dataclass(frozen=True, slots=True)
class Item:
    """One item of a frame."""

    kind: Kind
    data: bytes

    @property
    def seconds(self) -> float:
        """The number in a TIME or TOOK."""
        value: float = _TIME.unpack(self.data)[0]
        return value

    @property
    def count(self) -> int:
        """The number in a LOST."""
        return int.from_bytes(self.data, "little")

    @property
    def json(self) -> Any:
        """The value in a HEADER, CHECKPOINT, LOAD, STANDING or CHANGED."""
        return json.loads(self.data)


def item(kind: Kind, data: bytes = b"") -> bytes:
    """An item as bytes."""
    return _ITEM.pack(kind, len(data)) + data


def time_item(kind: Kind, seconds: float) -> bytes:
    """A TIME or TOOK as bytes."""
    return _ITEM.pack(kind, 8) + _TIME.pack(seconds)


def count_item(count: int) -> bytes:
    """A LOST as bytes."""
    return item(Kind.LOST, min(count, 0xFFFFFFFF).to_bytes(4, "little"))


def json_item(kind: Kind, value: Any) -> bytes:
    """A HEADER, CHECKPOINT, LOAD, STANDING or CHANGED as bytes; floats read back bit for bit."""
    return item(kind, json.dumps(value, separators=(",", ":")).encode())


def frame(items: Iterable[bytes]) -> bytes:
    """A frame around items that are bytes already."""
    payload = b"".join(items)
    return _FRAME.pack(len(payload), zlib.crc32(payload)) + payload


class DamageError(ValueError):
    """The bytes are not what was written; whatever came before them is."""


class FrameReader:
    """Frames from a stream of bytes that comes in pieces. `pending` is what does not make a whole frame yet."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._read = 0

    @property
    def pending(self) -> int:
        """Bytes of a frame that is not complete."""
        return len(self._buffer)

    def feed(self, piece: bytes) -> Iterator[bytes]:
        """The payloads that `piece` completes. Raises DamageError when a frame is not whole."""
        self._buffer += piece
        at = 0
        try:
            while len(self._buffer) - at >= _FRAME.size:
                length, checksum = _FRAME.unpack_from(self._buffer, at)
                if length > LARGEST_FRAME:
                    raise DamageError(f"no frame at byte {self._read + at}")
                end = at + _FRAME.size + length
                if end > len(self._buffer):
                    return
                payload = bytes(self._buffer[at + _FRAME.size : end])
                if zlib.crc32(payload) != checksum:
                    raise DamageError(f"wrong checksum of the frame at byte {self._read + at}")
                at = end
                yield payload
        finally:
            del self._buffer[:at]
            self._read += at


def items(payload: bytes) -> list[Item]:
    """The items of a frame. Raises DamageError when they do not fill it exactly."""
    found, at = [], 0
    while at < len(payload):
        if at + _ITEM.size > len(payload):
            raise DamageError("an item is cut short")
        kind, length = _ITEM.unpack_from(payload, at)
        at += _ITEM.size
        if at + length > len(payload) or kind not in _LENGTHS or _LENGTHS[kind] not in (None, length):
            raise DamageError(f"an item of kind {kind} and length {length} is not one of this format")
        found.append(Item(Kind(kind), payload[at : at + length]))
        at += length
    return found


_LENGTHS: dict[int, int | None] = {
    **dict.fromkeys(map(int, Kind)),
    Kind.LOST: 4,
    Kind.TIME: 8,
    Kind.ADVANCED: 0,
    Kind.CLOSING: 0,
    Kind.TOOK: 8,
}
"""How long an item's data are; None where that varies."""


@dataclass(slots=True)
class Ending:
    """How the reading of a segment ended. Neither is set when it was closed in order."""

    torn: bool = False
    """the last write did not get through: the writer was killed, or the disk was full"""
    damage: str = ""
    """bytes were altered; what stands before them was read"""


def read_frames(chunks: Iterable[bytes], ending: Ending) -> Iterator[list[Item]]:
    """The frames of a segment, oldest first, up to its end or to the first damage; `ending` then says which."""
    unzip, reader = zlib.decompressobj(GZIP), FrameReader()
    try:
        for piece in _small(chunks):
            for payload in reader.feed(unzip.decompress(piece)):
                yield items(payload)
        if unzip.unused_data:
            raise DamageError("bytes after the end of the stream")
    except (DamageError, zlib.error) as problem:
        ending.damage = str(problem)
        return
    ending.torn = not unzip.eof or reader.pending > 0


def _small(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """Pieces so small that little is lost with the one that zlib stumbles over."""
    for chunk in chunks:
        for at in range(0, len(chunk), _PIECE):
            yield chunk[at : at + _PIECE]

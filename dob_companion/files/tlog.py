"""Telemetry logs as ground stations write them: 64-bit big-endian µs of unix time, then a MAVLink frame as it was.

Only the outline of a frame is known here (MAVLink serialization guide: start byte, payload length, v2 signature flag),
so that messages of any dialect are logged, also those that the companion does not read.
"""

import struct
from collections.abc import Iterator

_STAMP = struct.Struct(">Q")
_V1, _V2 = 0xFE, 0xFD
_V1_AROUND, _V2_AROUND, _SIGNATURE = 8, 12, 13
"""Bytes around a payload: header and checksum; what a signature adds."""
_SIGNED = 0x01


class Splitter:
    """MAVLink frames out of a link's bytes: whole datagrams, or any pieces of a stream."""

    def __init__(self, *, datagrams: bool) -> None:
        self._datagrams = datagrams
        self._rest = b""

    def frames(self, data: bytes) -> Iterator[bytes]:
        """The frames that `data` completes; bytes between frames are left out."""
        data = self._rest + data
        at = 0
        while at < len(data):
            length = _length(data, at)
            if length is None:
                at += 1
                continue
            if at + length > len(data):
                break
            yield data[at : at + length]
            at += length
        self._rest = b"" if self._datagrams else data[at:]


def entry(unix_s: float, frame: bytes) -> bytes:
    """One entry of a log."""
    return _STAMP.pack(max(0, round(unix_s * 1e6))) + frame


def _length(data: bytes, at: int) -> int | None:
    """Length of the frame that begins at `at`; more than there is while unknown, None where none begins."""
    if data[at] not in (_V1, _V2):
        return None
    if len(data) - at < 3:
        return len(data) - at + 1
    if data[at] == _V1:
        return _V1_AROUND + data[at + 1]
    return _V2_AROUND + data[at + 1] + (_SIGNATURE if data[at + 2] & _SIGNED else 0)

"""Telemetry logs as ground stations write them: 64-bit big-endian µs of unix time, then a MAVLink frame as it was.

Only the outline of a frame is looked at, so that messages of any dialect are logged, also those that the companion does
not read.
"""

import struct
from collections.abc import Iterator

from dob_companion.mavlink.outline import size_at

_STAMP = struct.Struct(">Q")


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
            length = size_at(data, at)
            if not length:
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

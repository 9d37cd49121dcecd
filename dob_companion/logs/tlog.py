"""Telemetry logs (.tlog): arrival in µs of unix time, big-endian, before each MAVLink frame."""

import struct
from collections.abc import Iterator
from pathlib import Path

from dob_companion.files import read_bytes
from dob_companion.identification.record import Record
from dob_companion.logs.link import Heard, records_of
from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes
from dob_companion.mavlink.outline import KNOWN_FROM, V1, V2, size_at

_STAMP = struct.Struct(">Q")
_NEAR_US = 7 * 24 * 3600 * 1_000_000
"""After damage, an entry may be so much later or earlier than the one before."""


def looks_like_tlog(begin: bytes) -> bool:
    """Whether these first bytes may be a telemetry log's: µs of unix time begin with a zero until the year 4253."""
    return len(begin) > _STAMP.size and begin[0] == 0 and begin[_STAMP.size] in (V1, V2)


def read_tlog(path: Path, axes: VehicleAxes = IN_HOVER) -> tuple[Record, ...]:
    """The records of the vehicle that is heard first, which speaks in `axes`. Raises LogError, one line."""
    data = read_bytes(path)
    remarks: dict[str, None] = {}
    return records_of(lambda: _entries(data, remarks), str(path), remarks, axes)


def _entries(data: bytes, remarks: dict[str, None]) -> Iterator[Heard]:
    """The log's messages; what there is to remark, once however often it is read."""
    at, before, damaged = 0, None, 0
    while at + _STAMP.size + KNOWN_FROM <= len(data):
        begin = at + _STAMP.size
        size = size_at(data, begin)
        (stamp,) = _STAMP.unpack_from(data, at)
        if not size or (before is not None and abs(stamp - before) > _NEAR_US):
            damaged += 1
            at += 1
            continue
        if begin + size > len(data):
            break
        yield Heard(stamp * 1e-6, data[begin : begin + size])
        at, before = begin + size, stamp
    if damaged:
        remarks[f"{damaged} bytes between messages left out"] = None
    if at < len(data):
        remarks["ends in the middle of a message: what is whole was read"] = None

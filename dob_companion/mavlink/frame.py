"""MAVLink 2 frames of the messages that pass at the full rate, without an object for each: what costs pymavlink tens of
microseconds is a checksum and one unpacking. Whatever is not plainly such a frame is left to pymavlink."""

from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.outline import CHECKSUM, HEADER_V2, V2, number_of, size_at

EXTRA = [bytes((extra,)) for extra in range(256)]


def _by_pymavlink(covered: bytes) -> int:
    return int(mav.x25crc(covered).crc)


crc: Callable[[bytes], int] = mav.mcrf4xx or _by_pymavlink
"""CRC-16/MCRF4XX: in native code where pymavlink has it."""


def read_frame(data: bytes, known: dict[int, Any]) -> tuple[int, int, int, tuple[Any, ...]] | None:
    """System, component, message number and the fields in the order of the wire, when `data` is exactly one unsigned
    MAVLink 2 frame with a right checksum of one of the `known` messages (number to pymavlink's class); else None."""
    number = single_frame(data)
    if number is None or data[2]:
        return None
    layout = known.get(number)
    if layout is None or crc(data[1:-CHECKSUM] + EXTRA[layout.crc_extra]) != data[-2] | data[-1] << 8:
        return None
    return data[5], data[6], number, unpacked(layout, data[HEADER_V2:-CHECKSUM])


def unpacked(layout: Any, payload: bytes) -> tuple[Any, ...]:
    """The fields in the order of the wire, of the payload of a message of pymavlink's class `layout`."""
    size = layout.unpacker.size
    if len(payload) != size:  # trailing zeros are not sent, and a newer dialect may have fields more
        payload = payload[:size].ljust(size, b"\0")
    fields: tuple[Any, ...] = layout.unpacker.unpack(payload)
    return fields


def single_frame(data: bytes) -> int | None:
    """Message number of `data` that looks like exactly one MAVLink 2 frame, whole or not; None for anything else."""
    if len(data) < HEADER_V2 + CHECKSUM or data[0] != V2:
        return None
    return number_of(data) if size_at(data, 0) == len(data) else None


def write_frame(layout: Any, sequence: int, system: int, component: int, *fields: Any) -> bytes:
    """One message of pymavlink's class `layout`, its fields in the order of the wire."""
    payload: bytes = layout.unpacker.pack(*fields)
    payload = payload.rstrip(b"\0") or payload[:1]
    number: int = layout.id
    frame = bytes(
        (V2, len(payload), 0, 0, sequence, system, component, number & 0xFF, number >> 8 & 0xFF, number >> 16)
    )
    frame += payload
    return frame + crc(frame[1:] + EXTRA[layout.crc_extra]).to_bytes(2, "little")

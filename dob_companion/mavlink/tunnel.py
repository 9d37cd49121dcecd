"""A correction as the payload of TUNNEL: for autopilots that lose a stamp, or send on what has no target.

Little-endian: the stamp of the gyro sample that it answers (uint64, µs), roll, pitch, yaw moment to add (float).
"""

import struct
from typing import Any

from dob_companion.mavlink.facts import Axes3

PAYLOAD_TYPE = 53425
"""Above 32767, which MAVLink leaves to private use."""

PAYLOAD = struct.Struct("<Q3f")


def correction_in(message: Any) -> tuple[int, Axes3] | None:
    """Stamp and correction in a TUNNEL; None where it carries something else."""
    if message.payload_type != PAYLOAD_TYPE or message.payload_length != PAYLOAD.size:
        return None
    stamp, x, y, z = PAYLOAD.unpack(bytes(message.payload[: PAYLOAD.size]))
    return stamp, (x, y, z)

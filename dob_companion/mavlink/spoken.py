"""What a companion said, read back from its own messages: for those who look at a recorded flight."""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.facts import Axes3
from dob_companion.mavlink.tunnel import correction_in

_LONGEST = 200


@dataclass(frozen=True, slots=True)
class Correction:
    """The answer to the gyro sample of `stamp_us`: moment to add, normalized torque."""

    stamp_us: int
    moment: Axes3


@dataclass(frozen=True, slots=True)
class Telemetry:
    """DEBUG_FLOAT_ARRAY `DOB`. Moments in normalized torque, rate in Hz, delay in samples."""

    stamp_us: int
    d_hat: Axes3
    correction: Axes3
    state: int
    delay_samples: int
    rate_hz: float


@dataclass(frozen=True, slots=True)
class Text:
    """A STATUSTEXT."""

    severity: int
    text: str


@dataclass(frozen=True, slots=True)
class Value:
    """PARAM_VALUE: one of our parameters as it stands."""

    name: str
    value: float


Spoken = Correction | Telemetry | Text | Value


class SpokenReader:
    """Reads whole messages of ours; keeps no state from one to the next."""

    def __init__(self) -> None:
        self._parser = mav.MAVLink(None)

    def read(self, message: bytes) -> Spoken | None:
        """What the message says; None when it is none of these."""
        found = self._decoded(message)
        read = _READERS.get(found.get_msgId()) if found else None
        return read(found) if read else None

    def in_words(self, message: bytes) -> str:
        """Name and fields of any message, cut where it gets long."""
        text = str(self._decoded(message) or message.hex())
        return text if len(text) <= _LONGEST else text[:_LONGEST] + "…"

    def _decoded(self, message: bytes) -> Any:
        try:
            return self._parser.decode(bytearray(message))
        except (mav.MAVError, struct.error):
            return None


def _debug_vect(m: Any) -> Spoken | None:
    return Correction(m.time_usec, (m.x, m.y, m.z)) if m.name == "DOB_CORR" else None


def _actuator_target(m: Any) -> Spoken | None:
    roll, pitch, yaw = m.controls[:3]
    return Correction(m.time_usec, (roll, pitch, yaw))


def _tunnel(m: Any) -> Spoken | None:
    found = correction_in(m)
    return Correction(*found) if found else None


def _debug_float_array(m: Any) -> Spoken | None:
    d = m.data
    if m.name != "DOB":
        return None
    return Telemetry(m.time_usec, (d[0], d[1], d[2]), (d[3], d[4], d[5]), round(d[6]), round(d[7]), d[8])


def _text(m: Any) -> Spoken | None:
    return Text(m.severity, m.text)


def _param_value(m: Any) -> Spoken | None:
    return Value(m.param_id, m.param_value)


_READERS: dict[int, Callable[[Any], Spoken | None]] = {
    mav.MAVLINK_MSG_ID_DEBUG_VECT: _debug_vect,
    mav.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET: _actuator_target,
    mav.MAVLINK_MSG_ID_TUNNEL: _tunnel,
    mav.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY: _debug_float_array,
    mav.MAVLINK_MSG_ID_STATUSTEXT: _text,
    mav.MAVLINK_MSG_ID_PARAM_VALUE: _param_value,
}

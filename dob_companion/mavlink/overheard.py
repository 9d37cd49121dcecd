"""What an autopilot has told anybody, read from recorded frames: more than a companion needs in flight."""

import math
import struct
from collections.abc import Callable
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes
from dob_companion.mavlink.codec import AUTOPILOT, Codec, bytewise
from dob_companion.mavlink.facts import Axes3, Fact
from dob_companion.mavlink.frame import EXTRA, crc, unpacked
from dob_companion.mavlink.makes import PX4, make_of
from dob_companion.mavlink.outline import V1, checksum_of, covered, number_of, payload_of
from dob_companion.mavlink.profiles import Profile

_HEARTBEAT = mav.MAVLINK_MSG_ID_HEARTBEAT

_WORDS = {
    mav.MAV_TYPE_GENERIC: "",
    mav.MAV_TYPE_FIXED_WING: "plane",
    mav.MAV_TYPE_GROUND_ROVER: "rover",
    mav.MAV_TYPE_SURFACE_BOAT: "boat",
}


class Identity(NamedTuple):
    """An autopilot, by its heartbeat; `vehicle` in words: "quadrotor", "rover", …"""

    system: int
    make: str
    vehicle: str


class Attitude(NamedTuple):
    """Roll, pitch, yaw in rad."""

    stamp_us: int
    angles: Axes3


class AttitudeAsked(NamedTuple):
    """What the attitude and the rate controller follow, where the autopilot says so: rad, rad/s."""

    stamp_us: int
    angles: Axes3 | None
    rates: Axes3 | None


class Parameter(NamedTuple):
    """A parameter of the autopilot."""

    name: str
    value: float


Overheard = Fact | Attitude | AttitudeAsked | Parameter


def identity_in(frame: bytes) -> Identity | None:
    """The autopilot whose heartbeat a whole frame is."""
    if number_of(frame) != _HEARTBEAT or _sender(frame)[1] != AUTOPILOT:
        return None
    try:
        beat = mav.MAVLink(None).decode(bytearray(frame))
    except (mav.MAVError, struct.error):
        return None
    make = make_of(beat)
    return Identity(beat.get_srcSystem(), make, vehicle_in_words(beat.type)) if make else None


def _sender(frame: bytes) -> bytes:
    """System and component."""
    return frame[3:5] if frame[0] == V1 else frame[5:7]


def vehicle_in_words(kind: int) -> str:
    """What a MAV_TYPE is called, "" for one that says nothing."""
    known = mav.enums["MAV_TYPE"].get(kind)
    if kind in _WORDS or known is None:
        return _WORDS.get(kind, "")
    name: str = known.name.removeprefix("MAV_TYPE_").lower().replace("_", " ")
    return "vtol" if name.startswith("vtol reserved") else name


class Overhearing:
    """Reads whole frames of one vehicle's autopilot by the readers of its profile, as the companion does, and more.

    Rates and moments come in hover axes; `axes` are those in which the vehicle speaks. `damaged` counts frames whose
    checksum is wrong.
    """

    def __init__(self, identity: Identity, profile: Profile, axes: VehicleAxes = IN_HOVER) -> None:
        self.damaged = 0
        self._axes = axes
        self._make = identity.make
        self._codec = Codec(identity.system, profile=profile)
        self._sender = bytes((identity.system, AUTOPILOT))
        self._readers = {number: (reader.layout, reader.fact) for number, reader in profile.readers.items()}

    def read(self, frame: bytes) -> Overheard | None:
        """What the frame says, if anything."""
        number = number_of(frame)
        of_profile = self._readers.get(number)
        if of_profile is None and number not in _READERS and number != _HEARTBEAT:
            return None
        if _sender(frame) != self._sender:
            return None
        if number == _HEARTBEAT:
            return next(iter(self._codec.facts(frame)), None)
        layout = of_profile[0] if of_profile else _READERS[number][0]
        if crc(covered(frame) + EXTRA[layout.crc_extra]) != checksum_of(frame):
            self.damaged += 1
            return None
        fields = unpacked(layout, payload_of(frame))
        if of_profile is None:
            return _READERS[number][1](fields, self._make)
        fact = of_profile[1](fields)
        return None if fact is None else self._axes.inward(fact)


def _attitude(fields: tuple[Any, ...], _make: str) -> Attitude:
    return Attitude(fields[0] * 1000, fields[1:4])


def _attitude_asked(fields: tuple[Any, ...], _make: str) -> AttitudeAsked:
    stamp_ms, *q, roll, pitch, yaw, _thrust, ignored = fields[:10]
    rates = None if ignored & _NO_RATES else (roll, pitch, yaw)
    angles = None if ignored & mav.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE else euler(*q)
    return AttitudeAsked(stamp_ms * 1000, angles, rates)


def _parameter(fields: tuple[Any, ...], make: str) -> Parameter:
    """ArduPilot gives every value as a real number; PX4 the bytes of an integer as those of one."""
    value, _count, _index, name, kind = fields
    said = mav.MAVLink_param_value_message(name, value, kind, 0, 0)
    whole = bytewise(said) if make == PX4 else None
    return Parameter(name.rstrip(b"\0").decode("ascii", "replace"), float(value if whole is None else whole))


def euler(w: float, x: float, y: float, z: float) -> Axes3:
    """Roll, pitch, yaw of a quaternion that turns the body's axes into those of the earth."""
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    return (
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        math.asin(sine),
        math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


_NO_RATES = (
    mav.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
    | mav.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
    | mav.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE
)

_READERS: dict[int, tuple[Any, Callable[[tuple[Any, ...], str], Overheard]]] = {
    mav.MAVLINK_MSG_ID_ATTITUDE: (mav.MAVLink_attitude_message, _attitude),
    mav.MAVLINK_MSG_ID_ATTITUDE_TARGET: (mav.MAVLink_attitude_target_message, _attitude_asked),
    mav.MAVLINK_MSG_ID_PARAM_VALUE: (mav.MAVLink_param_value_message, _parameter),
}

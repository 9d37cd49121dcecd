"""PX4 with the module of deploy/px4: rates by PX4, the applied moment by the module as DEBUG_FLOAT_ARRAY `DOB_ACT`.

PX4 streams no ACTUATOR_CONTROL_TARGET. What it takes in as DEBUG_VECT loses its stamp, and with forwarding on goes out
again on every other link, the radio's too; a TUNNEL to the autopilot keeps the one and does not do the other.
"""

from dataclasses import replace

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink import makes
from dob_companion.mavlink.facts import AppliedMoment, Input
from dob_companion.mavlink.profiles.profile import Fields, Reader, Stream
from dob_companion.mavlink.profiles.sitl import SITL

MOMENT_NAME = b"DOB_ACT"
_RATE_HZ = SITL.rate_hz
_MOMENT = Stream(name="DEBUG_FLOAT_ARRAY", message=mav.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY, brings=Input.MOMENT)


def _moment(fields: Fields) -> AppliedMoment | None:
    """Stamp, id, name, then moment, thrust, correction, age in µs (-1: none)."""
    if fields[2].rstrip(b"\0") != MOMENT_NAME:
        return None
    age_us = fields[10]
    age = age_us if age_us < 0.0 else 1e-6 * _RATE_HZ * age_us
    return AppliedMoment(fields[0], fields[3:6], fields[6], fields[7:10], age)


PX4 = replace(
    SITL,
    name="px4",
    makes=(makes.PX4,),
    streams=tuple(_MOMENT if stream.brings is Input.MOMENT else stream for stream in SITL.streams),
    readers={number: reader for number, reader in SITL.readers.items() if number != SITL.stream(Input.MOMENT).message}
    | {_MOMENT.message: Reader(layout=mav.MAVLink_debug_float_array_message, fact=_moment)},
    carrier="TUNNEL",
    remedy="the module of deploy/px4 in the firmware, DOBC_EN 1 and extras.txt on the SD card (docs/px4.md): it adds "
    "corrections to the torque setpoint and answers with DEBUG_FLOAT_ARRAY DOB_ACT",
    speed_remedy="IMU_INTEG_RATE of 250 or more, MAV_n_RATE of 120000 or more",
    also_heard=("ACTUATOR_OUTPUT_STATUS", "SERVO_OUTPUT_RAW"),
)

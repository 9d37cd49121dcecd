"""ArduPilot: gyro rates by the autopilot, the applied moment by deploy/ardupilot/dob_correction.lua.

The script runs beside the main loop, some 200 times a second where that runs 400 times. It reads what the rate
controller puts out at any time within a loop, and what it adds acts from the next loop on, half a loop later in the
mean.
"""

from dataclasses import replace

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink import makes
from dob_companion.mavlink.facts import AppliedMoment, Fact, Input
from dob_companion.mavlink.profiles.profile import Fields
from dob_companion.mavlink.profiles.sitl import SITL

HALF_A_LOOP_US = 1250
"""Of a SCHED_LOOP_RATE of 400 Hz."""

_MOMENT = SITL.readers[mav.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET]


def _moment(fields: Fields) -> Fact | None:
    fact = _MOMENT.fact(fields)
    return replace(fact, read_late_us=HALF_A_LOOP_US) if isinstance(fact, AppliedMoment) else None


ARDUPILOT = replace(
    SITL,
    name="ardupilot",
    makes=(makes.ARDUPILOT,),
    streams=tuple(replace(s, unasked=s.brings is Input.MOMENT) for s in SITL.streams),  # by the script
    readers={**SITL.readers, mav.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET: replace(_MOMENT, fact=_moment)},
    remedy="deploy/ardupilot/dob_correction.lua on the SD card, with SCR_ENABLE 1 and FRAME_CLASS 17 "
    "(docs/ardupilot.md): a Lua script that adds DOB_CORR in the mixer and answers with ACTUATOR_CONTROL_TARGET",
    speed_remedy="SCHED_LOOP_RATE of 400 or more",
    also_heard=("RAW_IMU", "SERVO_OUTPUT_RAW"),
)

"""ArduPilot: gyro rates by the autopilot, the applied moment by deploy/ardupilot/dob_correction.lua, as in `sitl`."""

from dataclasses import replace

from dob_companion.mavlink import makes
from dob_companion.mavlink.profiles.sitl import SITL

ARDUPILOT = replace(
    SITL,
    name="ardupilot",
    makes=(makes.ARDUPILOT,),
    remedy="deploy/ardupilot/dob_correction.lua on the SD card, with SCR_ENABLE 1 and FRAME_CLASS 17 "
    "(docs/ardupilot.md): a Lua script that adds DOB_CORR in the mixer and answers with ACTUATOR_CONTROL_TARGET",
    speed_remedy="SCHED_LOOP_RATE of 400 or more",
    also_heard=("RAW_IMU", "SERVO_OUTPUT_RAW"),
)

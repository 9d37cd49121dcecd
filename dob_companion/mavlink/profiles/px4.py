"""PX4 with a module that speaks the contract of `sitl`: without one nothing takes a correction up."""

from dataclasses import replace

from dob_companion.mavlink import makes
from dob_companion.mavlink.profiles.sitl import SITL

PX4 = replace(
    SITL,
    name="px4",
    makes=(makes.PX4,),
    remedy="a module of your own that adds uORB debug_vect DOB_CORR to the torque setpoint, IMU_INTEG_RATE of 250 or "
    "more, and the torque sent as ACTUATOR_CONTROL_TARGET, which stock PX4 no longer does",
    speed_remedy="IMU_INTEG_RATE of 250 or more, MAV_n_RATE for the baud rate",
    also_heard=("ACTUATOR_OUTPUT_STATUS", "SERVO_OUTPUT_RAW"),
)

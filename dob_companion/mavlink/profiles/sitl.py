"""The contract of docs/interfaces.md, "On the wire: the vehicle": any autopilot can be taught to speak it."""

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.facts import AppliedMoment, GyroSample, Input, Landed, RcChannels
from dob_companion.mavlink.profiles.profile import AgeSource, Fields, LandedRule, Profile, Reader, Stream

SLOW_INTERVAL_US = 200_000
"""Flight state and RC channels: 5 Hz."""

LANDED = LandedRule(
    # MAV_STATE_ACTIVE says no more than armed: some say it on the ground as well.
    standing_by=frozenset(
        {mav.MAV_STATE_BOOT, mav.MAV_STATE_CALIBRATING, mav.MAV_STATE_STANDBY, mav.MAV_STATE_POWEROFF}
    ),
    states={
        mav.MAV_LANDED_STATE_ON_GROUND: Landed.ON_GROUND,
        mav.MAV_LANDED_STATE_IN_AIR: Landed.IN_AIR,
        mav.MAV_LANDED_STATE_TAKEOFF: Landed.TAKING_OFF,
        mav.MAV_LANDED_STATE_LANDING: Landed.LANDING,
    },
    hover=frozenset({mav.MAV_VTOL_STATE_UNDEFINED, mav.MAV_VTOL_STATE_MC}),
    failsafe=frozenset({mav.MAV_STATE_CRITICAL, mav.MAV_STATE_EMERGENCY, mav.MAV_STATE_FLIGHT_TERMINATION}),
)


def _gyro(fields: Fields) -> GyroSample:
    return GyroSample(fields[0], fields[4:7])


def _moment(fields: Fields) -> AppliedMoment | None:
    if fields[9] != 0:  # another group of controls
        return None
    return AppliedMoment(fields[0], fields[1:4], fields[4], fields[5:8], fields[8])


def _rc_channels(fields: Fields) -> RcChannels:
    return RcChannels(fields[1:19])


SITL = Profile(
    name="sitl",
    makes=(),
    streams=(
        Stream(name="HIGHRES_IMU", message=mav.MAVLINK_MSG_ID_HIGHRES_IMU, brings=Input.GYRO),
        Stream(name="ACTUATOR_CONTROL_TARGET", message=mav.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET, brings=Input.MOMENT),
        Stream(
            name="EXTENDED_SYS_STATE",
            message=mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
            brings=Input.FLIGHT_STATE,
            interval_us=SLOW_INTERVAL_US,
        ),
        Stream(
            name="RC_CHANNELS",
            message=mav.MAVLINK_MSG_ID_RC_CHANNELS,
            brings=Input.RC_CHANNELS,
            interval_us=SLOW_INTERVAL_US,
        ),
    ),
    readers={
        mav.MAVLINK_MSG_ID_HIGHRES_IMU: Reader(layout=mav.MAVLink_highres_imu_message, fact=_gyro),
        mav.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET: Reader(
            layout=mav.MAVLink_actuator_control_target_message, fact=_moment
        ),
        mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: Reader(layout=mav.MAVLink_extended_sys_state_message, fact=LANDED.read),
        mav.MAVLINK_MSG_ID_RC_CHANNELS: Reader(layout=mav.MAVLink_rc_channels_message, fact=_rc_channels),
    },
    carrier="DEBUG_VECT",
    age=AgeSource.REPORTED,
    landed=LANDED,
    rate_hz=250.0,
    remedy="a vehicle that sends the applied moment, adds DOB_CORR and lets it fade "
    "(docs/interfaces.md, On the wire: the vehicle)",
)

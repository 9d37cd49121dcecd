"""What is asked for and read besides a profile's own where an aircraft has limits of attitude, altitude and battery."""

import math
from dataclasses import replace

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.facts import Altitude, Attitude, Battery, Watched
from dob_companion.mavlink.profiles.profile import Fields, Profile, Reader, Stream

_REMAINING = mav.MAVLink_sys_status_message.ordered_fieldnames.index("battery_remaining")
_UNKNOWN = -1


def _attitude(fields: Fields) -> Attitude:
    return Attitude(fields[1:4])


def _altitude(fields: Fields) -> Altitude:
    return Altitude(1e-3 * fields[4])


def _battery(fields: Fields) -> Battery:
    percent = fields[_REMAINING]
    return Battery(math.nan if percent == _UNKNOWN else 1e-2 * percent)


_STREAMS = (
    Stream(name="ATTITUDE", message=mav.MAVLINK_MSG_ID_ATTITUDE, brings=Watched.ATTITUDE, interval_us=20_000),
    Stream(
        name="GLOBAL_POSITION_INT",
        message=mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        brings=Watched.ALTITUDE,
        interval_us=200_000,
    ),
    Stream(name="SYS_STATUS", message=mav.MAVLINK_MSG_ID_SYS_STATUS, brings=Watched.BATTERY, interval_us=1_000_000),
)
_READERS = {
    mav.MAVLINK_MSG_ID_ATTITUDE: Reader(layout=mav.MAVLink_attitude_message, fact=_attitude),
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: Reader(layout=mav.MAVLink_global_position_int_message, fact=_altitude),
    mav.MAVLINK_MSG_ID_SYS_STATUS: Reader(layout=mav.MAVLink_sys_status_message, fact=_battery),
}


def watching(profile: Profile) -> Profile:
    """The same vehicle, of which attitude (50 Hz), altitude (5 Hz) and battery (1 Hz) are wanted as well."""
    return replace(profile, streams=(*profile.streams, *_STREAMS), readers={**profile.readers, **_READERS})

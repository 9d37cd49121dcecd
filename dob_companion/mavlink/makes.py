"""Who made an autopilot, as its HEARTBEAT says."""

from typing import Any

from pymavlink.dialects.v20 import common as mav

ARDUPILOT, PX4, GENERIC, OTHER = "ArduPilot", "PX4", "generic", "other"

_MAKES = {
    mav.MAV_AUTOPILOT_ARDUPILOTMEGA: ARDUPILOT,
    mav.MAV_AUTOPILOT_PX4: PX4,
    mav.MAV_AUTOPILOT_GENERIC: GENERIC,
}


def make_of(heartbeat: Any) -> str:
    """ "ArduPilot", "PX4", "generic" or "other" for an autopilot, "" for anything else that beats."""
    if heartbeat.autopilot == mav.MAV_AUTOPILOT_INVALID or heartbeat.get_srcComponent() != mav.MAV_COMP_ID_AUTOPILOT1:
        return ""
    return _MAKES.get(heartbeat.autopilot, OTHER)

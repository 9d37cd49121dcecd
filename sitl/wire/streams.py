"""Which message goes out how often on one link."""

from math import inf

from pymavlink.dialects.v20 import common as mavlink

GROUND_STREAMS = {
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 0.05,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 0.1,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 0.2,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 0.2,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 0.2,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: 0.25,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 0.5,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 0.5,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: 1.0,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: 1.0,
}
"""Intervals towards the ground station, s: what a radio modem carries easily."""

COMPANION_STREAMS = {
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 0.1,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 0.5,
}
"""Intervals towards the companion beside the pair of each sample, s."""

FASTEST_S = 0.004


class Streams:
    """Intervals and due times of one link's periodic messages, on whatever clock `due` is called with."""

    def __init__(self, defaults: dict[int, float]) -> None:
        self._defaults = defaults
        self._interval = dict(defaults)
        self._due = dict.fromkeys(defaults, -inf)
        self.next_due = -inf

    def interval(self, message_id: int) -> float:
        """Seconds between two messages; inf when it is off."""
        return self._interval.get(message_id, inf)

    def set_interval(self, message_id: int, interval_us: float) -> None:
        """As MAV_CMD_SET_MESSAGE_INTERVAL means it: µs; 0 the default, negative off; never faster than `FASTEST_S`."""
        if interval_us == 0.0:
            seconds = self._defaults.get(message_id, inf)
        else:
            seconds = max(FASTEST_S, interval_us * 1e-6) if interval_us > 0.0 else inf
        self._interval[message_id] = seconds
        self._due[message_id] = -inf if seconds < inf else inf
        self.next_due = -inf

    def due(self, now: float) -> list[int]:
        """Message ids to send at `now` (s); a late call sends each once, not once per interval missed."""
        if now < self.next_due:
            return []
        ready = [i for i, t in self._due.items() if t <= now]
        for i in ready:
            step = self._interval[i]
            on_time = self._due[i] + step
            self._due[i] = on_time if on_time > now else now + step
        self.next_due = min(self._due.values(), default=inf)
        return ready

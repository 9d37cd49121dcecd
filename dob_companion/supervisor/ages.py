"""How old, in s, what was told may grow before it counts no more (docs/interfaces.md, How long a fact counts)."""

HEARTBEAT_S = 5.0
"""HEARTBEAT, sent at 1 Hz: armed, standing by."""

FLIGHT_STATE_S = 2.0
"""EXTENDED_SYS_STATE, asked for at 5 Hz, once the vehicle has told it: in the air, in multicopter mode."""

KILL_SWITCH_S = 2.0
"""RC_CHANNELS with the kill switch's channel in it, asked for at 5 Hz."""

ROUND_TRIP_S = 5.0
"""TIMESYNC, asked at 1 Hz: the delay, of a vehicle that does not report it. Wall time."""

STRANGER_S = 5.0
"""Wall time after the last message of another controller until the link is ours alone again."""

VEHICLE_S = 10.0
"""Wall time without a word of the vehicle after which another autopilot on the link is taken for it."""


class Told:
    """When a fact was last told, on our clock and on the vehicle's; s.

    Its age is what has passed on both. The vehicle's clock stands while a simulation in lockstep waits, and ours hardly
    moves while one runs ahead; and where this computer was held up, what waits unread in the socket is not old.
    """

    __slots__ = ("_vehicle_s", "_wall_s")

    def __init__(self) -> None:
        self.forget()

    def at(self, now: float, vehicle_s: float) -> None:
        """It was told at this time."""
        self._wall_s, self._vehicle_s = now, vehicle_s

    def forget(self) -> None:
        """It was told too long ago to count, or never."""
        self._wall_s = self._vehicle_s = float("-inf")

    def age(self, now: float, vehicle_s: float) -> float:
        """Its age; inf when it was never told."""
        return min(now - self._wall_s, vehicle_s - self._vehicle_s)

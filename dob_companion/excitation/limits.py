"""How far an aircraft may be moved, and whether it has been moved further. Each setter takes one message's worth."""

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

from dob_companion.mavlink import Watched
from dob_companion.mavlink.facts import Axes3
from dob_companion.supervisor.ages import Told

RATES_MEANT = 5
"""Samples over which a body rate is averaged: a spike of vibration is no motion. 20 ms at 250 Hz."""

OLDEST_S = {Watched.ATTITUDE: 0.5, Watched.ALTITUDE: 2.0, Watched.BATTERY: 10.0}
"""How long what was told counts; asked for at 50, 5 and 1 Hz."""

HEARING_S = 3.0
"""Wall time after which what has not been told is taken for what this vehicle does not tell."""


class Reason(NamedTuple):
    """Why it ends, and whether so suddenly that the moment fades within 0.1 s."""

    text: str
    at_once: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """rate             largest body rate of any axis, rad/s
    tilt             largest angle to the vertical, rad
    altitude_change  from where the excitation of all axes began, m
    battery          least charge, 0…1
    """

    rate: float = 1.5
    tilt: float = math.radians(25.0)
    altitude_change: float = 2.0
    battery: float = 0.2


class Guard:
    """Says what is beyond its limits. Attitude, altitude and battery limit a vehicle that tells them, which must then
    go on telling them; rates, flight mode and the autopilot's own failsafe always do.

    `now` is wall time in s; `vehicle_time` tells the vehicle's own.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._since: float | None = None
        self._vehicle_s = 0.0
        self.rate = 0.0
        """Largest body rate now, rad/s, of any axis."""
        self._recent: deque[Axes3] = deque(maxlen=RATES_MEANT)
        self._told = {what: Told() for what in Watched}
        self._heard: set[Watched] = set()
        self._awaited = set(Watched)
        self._tilt = self._altitude = 0.0
        self._charge = 1.0
        self._mode: int | None = None
        self._failsafe = False
        self._began_at: tuple[float, int | None] | None = None

    def vehicle_time(self, seconds: float) -> None:
        """The vehicle's clock, by the stamp of its newest sample."""
        self._vehicle_s = seconds

    def rates(self, rates: Axes3) -> None:
        """Body rates of one sample, rad/s, finite."""
        recent = self._recent
        recent.append(rates)
        roll = pitch = yaw = 0.0
        for one in recent:
            roll, pitch, yaw = roll + one[0], pitch + one[1], yaw + one[2]
        self.rate = max(abs(roll), abs(pitch), abs(yaw)) / len(recent)

    def attitude(self, angles: Axes3, now: float) -> None:
        """Roll, pitch, yaw, rad. What is not finite tells nothing."""
        if all(map(math.isfinite, angles)):
            self._tilt = math.acos(max(-1.0, min(1.0, math.cos(angles[0]) * math.cos(angles[1]))))
            self._tell(Watched.ATTITUDE, now)

    def altitude(self, metres: float, now: float) -> None:
        """Altitude, m."""
        self._altitude = metres
        self._tell(Watched.ALTITUDE, now)

    def battery(self, share: float, now: float) -> None:
        """Charge that is left, 0…1; what is not finite tells nothing."""
        self._awaited.discard(Watched.BATTERY)
        if math.isfinite(share):
            self._charge = share
            self._tell(Watched.BATTERY, now)

    def heartbeat(self, mode: int, now: float, *, failsafe: bool) -> None:
        """The autopilot's flight mode by number, and whether it says that it is in trouble."""
        self._since = now if self._since is None else self._since
        self._mode, self._failsafe = mode, failsafe

    def begin(self) -> None:
        """It begins here, in this flight mode."""
        self._began_at = self._altitude, self._mode

    def listening(self, now: float) -> bool:
        """Whether something that would be limited may still be heard for the first time."""
        return bool(self._awaited) and (self._since is None or now - self._since < HEARING_S)

    @property
    def unheard(self) -> list[str]:
        """What this vehicle does not tell, so that it limits nothing."""
        return [what.value for what in Watched if what not in self._heard]

    def broken(self, now: float) -> Reason | None:
        """The limit that does not hold; None while all do."""
        limits, rate = self._limits, self.rate
        if rate > limits.rate:
            return Reason(f"body rate {rate:.2f} rad/s beyond {limits.rate:g}")
        for what in self._heard:
            if self._told[what].age(now, self._vehicle_s) > OLDEST_S[what]:
                return Reason(f"{what.value} no longer told")
        if self._tilt > limits.tilt:
            return Reason(f"tilt {math.degrees(self._tilt):.0f} deg beyond {math.degrees(limits.tilt):.0f}")
        if self._failsafe:
            return Reason("autopilot reports a failsafe")
        if self._charge < limits.battery:
            return Reason(f"battery {100 * self._charge:.0f} % below {100 * limits.battery:.0f} %", at_once=False)
        return self._moved()

    def _moved(self) -> Reason | None:
        if self._began_at is None:
            return None
        altitude, mode = self._began_at
        if mode != self._mode:
            return Reason("flight mode changed")
        change = self._altitude - altitude
        if not abs(change) <= self._limits.altitude_change:
            return Reason(f"altitude changed by {change:+.1f} m", at_once=False)
        return None

    def _tell(self, what: Watched, now: float) -> None:
        self._heard.add(what)
        self._awaited.discard(what)
        self._told[what].at(now, self._vehicle_s)


class Probe:
    """The first second of an axis at a share of the amplitude shows how much the aircraft moves; where the whole would
    move it near its limit, less than the whole is then given."""

    SHARE, SECONDS, OF_THE_LIMIT = 0.3, 1.0, 0.6

    def __init__(self, rate_limit: float) -> None:
        self._allowed = self.OF_THE_LIMIT * rate_limit
        self._peak = 0.0
        self._since: float | None = None
        self.level: float | None = None
        """Share of the amplitude that the aircraft bears; None while it is tried."""

    def target(self, seconds: float, f: float, rate: float) -> float:
        """Where the fade f is to go, `seconds` into the axis, at a body rate of `rate` rad/s."""
        if self.level is not None:
            return self.level
        self._peak = max(self._peak, rate)
        if f < self.SHARE:
            return self.SHARE
        self._since = seconds if self._since is None else self._since
        if seconds - self._since >= self.SECONDS:
            bearable = self.SHARE * self._allowed / self._peak if self._peak > 0.0 else 1.0
            self.level = max(self.SHARE, min(1.0, bearable))
        return self.SHARE

"""Which inputs belong to which sample: gyro rates and applied moment, paired by the vehicle's stamp.

A step of the observer from sample k needs y_n(k) and u_e(k), both stamped t_k, whatever the order of arrival.
What a lossy link makes of that is decided here:

* one missing sample is bridged: rates by the mean of their neighbours (the error is of second order in dt), the
  moment by the last known one. Two in a row are a gap: the observer starts anew;
* a stamp that is not newer than the newest is a repeat or late, and never a step;
* a stamp more than a second older, or further ahead than a gap, is a clock that has jumped: start anew.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

RESTART_US = 1_000_000
"""A stamp this much older than the newest is no late message but a restarted clock."""

STAMP_TOLERANCE = 0.25
"""Share of dt by which an interval may differ from a whole number of samples."""

_KEPT_MOMENTS = 8


class Arrival(Enum):
    """What a gyro stamp turns out to be."""

    NEXT = "next"
    GAP = "gap"
    RESTART = "restart"
    REPEAT = "repeat"
    LATE = "late"


@dataclass(slots=True)
class PairingCounters:
    """How the samples came in."""

    stepped: int = 0
    bridged: int = 0
    gaps: int = 0
    repeats: int = 0
    late: int = 0
    restarts: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """One finished sample for the observer: rates (rad/s) and applied moment (normalized torque), shape (3,)."""

    rates: Vector
    moment: Vector


class Pairing:
    """Turns stamped arrivals into a gapless sequence of finished samples."""

    def __init__(self, dt: float) -> None:
        self.counters = PairingCounters()
        self._dt_us = 1e6 * dt
        self._newest: int | None = None
        self._rates: Vector = np.zeros(3)
        self._moments: dict[int, Vector] = {}
        self._last_moment: Vector | None = None
        self._bridged_last = False

    @property
    def newest_us(self) -> int | None:
        """Stamp of the newest gyro sample; None before the first."""
        return self._newest

    def moment(self, stamp_us: int, moment: Vector) -> bool:
        """Keep the moment of a stamp. False when it is late (its step is done) or was given before."""
        too_old = self._newest is not None and stamp_us < self._newest
        if too_old or stamp_us in self._moments:
            self.counters.late += 1
            return False
        self._moments[stamp_us] = moment
        if len(self._moments) > _KEPT_MOMENTS:
            del self._moments[min(self._moments)]
        return True

    def gyro(self, stamp_us: int, rates: Vector) -> tuple[Arrival, tuple[Inputs, ...]]:
        """Take a gyro sample: what it is, and the samples before it that the observer can now finish."""
        previous = self._newest
        if previous is not None:
            if stamp_us == previous:
                self.counters.repeats += 1
                return Arrival.REPEAT, ()
            if previous - RESTART_US < stamp_us < previous:
                self.counters.late += 1
                return Arrival.LATE, ()
        finished = None if previous is None else self._finish(previous, stamp_us, rates)
        restarted = previous is not None and stamp_us < previous
        self._newest, self._rates = stamp_us, rates
        self._moments = {} if restarted else {t: m for t, m in self._moments.items() if t >= stamp_us}
        if finished is None:
            self.counters.restarts += restarted
            self.counters.gaps += previous is not None and not restarted
            self._last_moment, self._bridged_last = None, False
            return Arrival.RESTART if restarted else Arrival.GAP, ()
        self.counters.stepped += len(finished)
        return Arrival.NEXT, finished

    def spoil(self, stamp_us: int) -> None:
        """An input of this stamp cannot be used: whatever comes next comes after a gap."""
        self._newest = max(stamp_us, self._newest or 0)
        self._moments.clear()
        self._last_moment, self._bridged_last = None, True

    def _finish(self, previous: int, stamp_us: int, rates: Vector) -> tuple[Inputs, ...] | None:
        """The samples from `previous` up to, not including, `stamp_us`; None when that is a gap."""
        intervals = (stamp_us - previous) / self._dt_us
        count = round(intervals)
        if count not in (1, 2) or abs(intervals - count) > STAMP_TOLERANCE:
            return None
        known = self._moments.pop(previous, None)
        between = self._between(previous, stamp_us) if count == 2 else None
        first = known if known is not None else self._last_moment
        if first is None:
            return None
        bridged = known is None or count == 2
        if bridged and self._bridged_last:
            return None
        self._bridged_last = bridged
        self.counters.bridged += bridged
        self._last_moment = first
        if count == 1:
            return (Inputs(self._rates, first),)
        if between is not None:
            self._last_moment = between
        return (Inputs(self._rates, first), Inputs(0.5 * (self._rates + rates), self._last_moment))

    def _between(self, previous: int, stamp_us: int) -> Vector | None:
        return next((m for t, m in self._moments.items() if previous < t < stamp_us), None)

"""Stamped arrivals to a gapless sequence of samples at the design's rate.

The observer is a discrete system of one dt. Autopilots stamp at 4.0 ms if all is well, in steps like 2.5, 5.0, 2.5 ms
if their loop runs at 400 Hz, and links lose messages. So the observer has a grid of its own on the vehicle's clock:

* the rate at a grid point is the line between the two gyro samples around it (the error is of second order in dt);
* the moment of a grid interval is the mean of what acted in it: u_e of stamp t acts from t until the next stamp,
  whether or not its stamps coincide with the gyro's;
* a sample that falls on its grid point (within 2 % of dt) *is* that point, and the grid follows it, so a regular
  stream is taken as it is and a slow drift of the vehicle's clock does no harm.

Why this and not steps of the measured length: an observer designed in discrete time may have poles that no continuous
system has (on the negative real axis, or at 0 after a delay), and then A^(h/dt) does not exist.

What a lossy link makes of it: one missing message is bridged by the same line and mean, and counted; two in a row are
a gap, after which the observer starts anew. A stamp that is not newer than the newest is a repeat or late, and never a
step. A stamp more than a second older is a clock that has jumped.
"""

from bisect import insort
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from operator import itemgetter
from typing import NamedTuple

from dob_companion.companion.clocks import ClockCheck
from dob_companion.mavlink.facts import Axes3

RESTART_US = 1_000_000
"""A stamp this much older than the newest is no late message but a restarted clock."""

SNAP = 0.02
"""Share of dt within which a sample counts as lying on its grid point."""

ONE_MISSING, GAP = 1.5, 2.6
"""Intervals of gyro stamps, in dt, above which one sample is missing, and above which it is a gap."""

STALE_MOMENT = 1.9
"""Age of the newest moment at a grid point, in dt, above which more than one is missing."""

AHEAD = 32
"""A moment stamped so many dt ahead of the newest gyro sample is of no use when that one's successor comes: between
them lies a gap."""

MOST_MOMENTS = 64
"""Moments kept at most, the newest."""


class Arrival(Enum):
    """What a gyro stamp turns out to be."""

    NEXT = "next"
    GAP = "gap"
    RESTART = "restart"
    REPEAT = "repeat"
    LATE = "late"


@dataclass(slots=True)
class SampleCounters:
    """How the samples came in."""

    stepped: int = 0
    bridged: int = 0
    gaps: int = 0
    repeats: int = 0
    late: int = 0
    early: int = 0
    restarts: int = 0


Inputs = tuple[Axes3, Axes3]
"""One interval of the grid: rates at its begin (rad/s) and mean applied moment (normalized torque)."""


class Arrived(NamedTuple):
    """A gyro sample taken in: what it is, the intervals that it completes, and the rates at the newest grid point."""

    arrival: Arrival
    finished: tuple[Inputs, ...]
    rates: Axes3


class Samples:
    """The grid of one vehicle."""

    def __init__(self, dt: float) -> None:
        self.counters = SampleCounters()
        self.clocks = ClockCheck(dt)
        self._dt_us = 1e6 * dt
        self._tolerance_us = SNAP * self._dt_us
        self._newest: int | None = None
        self._rates: Axes3 = (0.0, 0.0, 0.0)
        self._grid = 0.0
        self._grid_rates: Axes3 = (0.0, 0.0, 0.0)
        self._moments: list[tuple[int, Axes3]] = []
        self._newest_moment: int | None = None
        self._bridged_last = False
        self._spoilt = False

    @property
    def newest_us(self) -> int | None:
        """Stamp of the newest gyro sample; None before the first."""
        return self._newest

    def moment(self, stamp_us: int, moment: Axes3) -> bool:
        """Keep the moment that acts from a stamp on. False when it is late (its interval is done), a repeat, or far
        ahead of the gyro."""
        self.clocks.moment(stamp_us)
        if self._newest is not None and stamp_us > self._newest + AHEAD * self._dt_us:
            self.counters.early += 1
            return False
        known = any(stamp == stamp_us for stamp, _ in self._moments)
        if known or (self._newest is not None and stamp_us < self._grid - self._tolerance_us):
            self.counters.late += 1
            return False
        previous = self._newest_moment
        one_missing = previous is not None and ONE_MISSING < (stamp_us - previous) / self._dt_us <= GAP
        self.counters.bridged += one_missing and not self._bridged_last  # a lost pair counts once
        self._newest_moment = max(stamp_us, previous or 0)
        self._forget()
        insort(self._moments, (stamp_us, moment), key=itemgetter(0))
        del self._moments[:-MOST_MOMENTS]
        return True

    def foreseen(self) -> Inputs | None:
        """The next interval, if the next gyro sample completes it on time and brings no other moment with it."""
        if not self._moments:
            return None
        stamp, moment = self._moments[-1]
        return (self._grid_rates, moment) if abs(stamp - self._grid) <= self._tolerance_us else None

    def gyro(self, stamp_us: int, rates: Axes3) -> Arrived:
        """Take in a gyro sample whose stamp is new (see `known`)."""
        self.clocks.gyro(stamp_us)
        previous = self._newest
        if previous is None:
            return self._begin(stamp_us, rates, Arrival.GAP)
        if stamp_us < previous:
            self.counters.restarts += 1
            self._moments.clear()
            return self._begin(stamp_us, rates, Arrival.RESTART)
        finished = None if self._spoilt else self._finish(previous, stamp_us, rates)
        if finished is None:
            self.counters.gaps += 1
            return self._begin(stamp_us, rates, Arrival.GAP)
        self._newest, self._rates = stamp_us, rates
        self.counters.stepped += len(finished)
        return Arrived(Arrival.NEXT, finished, self._grid_rates)

    def known(self, stamp_us: int) -> Arrival | None:
        """REPEAT or LATE, counted, for a gyro stamp that brings nothing new; None for one that does."""
        if self._newest is None or not self._newest - RESTART_US < stamp_us <= self._newest:
            return None
        if stamp_us == self._newest:
            self.counters.repeats += 1
            return Arrival.REPEAT
        self.counters.late += 1
        return Arrival.LATE

    def spoil(self) -> None:
        """An input cannot be used: the next gyro sample comes after a gap."""
        self._spoilt = True
        self._moments.clear()
        self._newest_moment = None

    def spoil_gyro(self, stamp_us: int) -> None:
        """The gyro sample of a new stamp cannot be used; it counts as the newest all the same."""
        self._newest = stamp_us
        self.spoil()

    def _begin(self, stamp_us: int, rates: Axes3, arrival: Arrival) -> Arrived:
        self._newest, self._rates = stamp_us, rates
        self._grid, self._grid_rates = float(stamp_us), rates
        self._moments = [(stamp, moment) for stamp, moment in self._moments if stamp >= stamp_us]
        self._newest_moment, self._bridged_last, self._spoilt = None, False, False
        return Arrived(arrival, (), rates)

    def _finish(self, previous: int, stamp_us: int, rates: Axes3) -> tuple[Inputs, ...] | None:
        """The intervals up to `stamp_us`; None when what would be needed for them is missing."""
        interval = (stamp_us - previous) / self._dt_us
        bridged = interval > ONE_MISSING
        if interval > GAP or (bridged and self._bridged_last):
            return None
        finished = []
        while (end := self._next_point(stamp_us)) <= stamp_us:
            moment = self._mean_moment(self._grid, end)
            if moment is None:
                return None
            finished.append((self._grid_rates, moment))
            share = (end - previous) / (stamp_us - previous)
            self._grid_rates = rates if end == stamp_us else _between(self._rates, rates, share)
            self._grid = end
        self._bridged_last = bridged
        self.counters.bridged += bridged
        return tuple(finished)

    def _next_point(self, stamp_us: int) -> float:
        point = self._grid + self._dt_us
        return float(stamp_us) if abs(point - stamp_us) <= self._tolerance_us else point

    def _mean_moment(self, begin: float, end: float) -> Axes3 | None:
        """Time mean of the moment over an interval; None when too old a value, or none, acts at its begin."""
        at_begin, before_end = begin + self._tolerance_us, end - self._tolerance_us
        pieces: list[tuple[int, Axes3]] = []
        for piece in self._moments:  # in order of their stamps
            if piece[0] <= at_begin:
                pieces = [piece]
            elif pieces and piece[0] < before_end:
                pieces.append(piece)
        if not pieces or begin - pieces[0][0] > STALE_MOMENT * self._dt_us:
            return None
        return pieces[0][1] if len(pieces) == 1 else _mean(pieces, begin, end)

    def _forget(self) -> None:
        """Drop the moments that no later interval can need."""
        limit = self._grid + self._tolerance_us
        acting = sum(stamp <= limit for stamp, _ in self._moments)
        del self._moments[: max(0, acting - 1)]


def _between(before: Axes3, after: Axes3, share: float) -> Axes3:
    """The point on the line from `before` (share 0) to `after` (share 1)."""
    roll, pitch, yaw = (a + share * (b - a) for a, b in zip(before, after, strict=True))
    return roll, pitch, yaw


def _mean(pieces: list[tuple[int, Axes3]], begin: float, end: float) -> Axes3:
    """Time mean over begin…end of values that act from their stamps on, the first of them from `begin`."""
    edges = [begin, *(float(stamp) for stamp, _ in pieces[1:]), end]
    shares = [(after - before) / (end - begin) for before, after in pairwise(edges)]
    roll, pitch, yaw = (
        sum(share * moment[axis] for share, (_, moment) in zip(shares, pieces, strict=True)) for axis in range(3)
    )
    return roll, pitch, yaw

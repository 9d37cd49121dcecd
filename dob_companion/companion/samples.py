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

What a lossy link makes of it: up to a bound that follows from the design (`observer.missing`), samples that did not
come are put in as the design's own model expects them, given what came before and the sample that ended the silence.
A moment is held until the next, unless a program beside the controller has read it: then the controller's part lies on
the line between two readings, for what is held would be late by half the time between them, and in a closed loop that
is another plant. When more than HELD of them are missing, the gyro's samples say nothing that could be
told from a change of the moment: until the next moment comes, those that the model expects stand for them. What comes
late is no loss: the difference between what an interval was finished with and what is known now is told, and the
observer put right. Beyond the bound it is a gap, after which the observer starts anew. A gyro stamp that is not newer
than the newest is a repeat or late, and never a step. A stamp more than a second older is a clock that has jumped.
"""

import math
from bisect import insort
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from operator import itemgetter
from typing import NamedTuple, Protocol

from dob_companion.companion.clocks import ClockCheck
from dob_companion.mavlink.facts import Axes3
from dob_companion.observer import Missing
from dob_companion.observer.missing import HELD

RESTART_US = 1_000_000
"""A stamp this much older than the newest is no late message but a restarted clock."""

SNAP = 0.02
"""Share of dt within which a sample counts as lying on its grid point."""

WHOLE = 0.5
"""Share of dt by which an interval of stamps, or the age of a moment, may be longer than whole samples: stamps in steps
of 2.5 and 5 ms are not missing any."""

AHEAD = 32
"""A moment stamped so many dt ahead of the newest gyro sample is of no use when that one's successor comes: between
them lies a gap."""

NOTHING: Axes3 = (0.0, 0.0, 0.0)

MOST_MOMENTS = 64
"""Moments kept at most, the newest."""


def revisable(missing: Missing) -> int:
    """Finished intervals that a moment may still change: it comes that late, or there was a gap."""
    return missing.moments + 2


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


_Moment = tuple[int, Axes3, Axes3, int | None]
"""Stamp; the controller's part, or all where it was not read beside it; ours; how late that acts (None: not read)."""

Inputs = tuple[Axes3, Axes3]
"""One interval of the grid: rates at its begin (rad/s) and mean applied moment (normalized torque)."""

_Interval = tuple[float, float, Axes3, Inputs]
"""A finished interval of the grid: its ends, µs, the rates at its begin, and what it was finished with."""

Revision = tuple[int, Axes3, Axes3]
"""So many intervals ago (0: the last finished) rates and mean moment were in truth larger by so much."""


class Model(Protocol):
    """What is expected of the gyro (`observer.GyroModel`), after the intervals whose `follow_up` is done."""

    def bridge(self, first: Axes3, moments: Sequence[Axes3], last: Axes3, beyond: float) -> list[Axes3]:
        """Rates at the end of each interval, given those at the first begin and `beyond` dt after the last end."""

    def expect(self, finished: Sequence[Inputs], moment: Axes3) -> Axes3:
        """Rates after further intervals, under a moment."""


class Arrived(NamedTuple):
    """A gyro sample taken in: what it is, the intervals that it completes, and the rates at the newest grid point.

    After a gap these are the intervals of the gap, as far as something can be put in: good for a last estimate to fade
    from, and nothing else.
    """

    arrival: Arrival
    finished: tuple[Inputs, ...]
    rates: Axes3


class Samples:
    """The grid of one vehicle.

    `missing`: what may be missing before it is a gap; `model` says what stands for samples that cannot be used.
    """

    def __init__(self, dt: float, missing: Missing, model: Model) -> None:
        self.counters = SampleCounters()
        self.clocks = ClockCheck(dt)
        self._missing, self._model = missing, model
        self._dt_us = 1e6 * dt
        self._tolerance_us = SNAP * self._dt_us
        self._longest_held_us = (HELD + WHOLE) * self._dt_us
        self._newest: int | None = None
        self._rates: Axes3 = (0.0, 0.0, 0.0)
        self._grid = 0.0
        self._grid_rates: Axes3 = (0.0, 0.0, 0.0)
        self._moments: list[_Moment] = []
        self._finished: deque[_Interval] = deque(maxlen=revisable(missing))
        self.lost = 0
        """Samples that did not come between the newest and the one before."""
        self._owed = 0  # missing samples that have not been made up for, each by one that follows its predecessor
        self._spoilt = False

    @property
    def newest_us(self) -> int | None:
        """Stamp of the newest gyro sample; None before the first."""
        return self._newest

    def moment(
        self, stamp_us: int, moment: Axes3, ours: Axes3 = NOTHING, read_late_us: int | None = None
    ) -> tuple[Revision, ...] | None:
        """Keep the moment that acts from a stamp on. Returns what it changes in finished intervals.

        `ours`, the part of it that came from us, matters for one that was read (`AppliedMoment.read_late_us`).

        None when it is a repeat, far ahead of the gyro, or older than another and stamped before the newest grid point.
        """
        self.clocks.moment(stamp_us)
        if self._newest is not None and stamp_us > self._newest + AHEAD * self._dt_us:
            self.counters.early += 1
            return None
        finished = self._newest is not None and stamp_us < self._grid - self._tolerance_us
        known = any(stamp == stamp_us for stamp, *_ in self._moments)
        if known or (finished and self._moments and stamp_us < self._moments[-1][0]):
            self.counters.late += 1
            return None
        before = max((stamp for stamp, *_ in self._moments if stamp < stamp_us), default=0)
        last = max(stamp_us, self._moments[-1][0]) if self._moments else stamp_us
        read = read_late_us is not None
        kept = (stamp_us, _difference(moment, ours), ours, read_late_us) if read else (stamp_us, moment, NOTHING, None)
        begin, end = self._finished[-1][:2] if self._finished else (0.0, 0.0)
        on_line = read or last - before > self._longest_held_us  # it may begin or end in the last interval as well
        awaited = before < (end if on_line else begin) - self._tolerance_us
        self._forget()
        insort(self._moments, kept, key=itemgetter(0))
        del self._moments[:-MOST_MOMENTS]
        return tuple(self._revised()) if finished or awaited else ()

    def foreseen(self) -> Inputs | None:
        """The next interval, if the next gyro sample completes it on time and brings no other moment with it."""
        if not self._moments:
            return None
        newest = self._moments[-1]
        return (self._grid_rates, _whole(newest)) if abs(newest[0] - self._grid) <= self._tolerance_us else None

    def gyro(self, stamp_us: int, rates: Axes3) -> Arrived:
        """Take in a gyro sample whose stamp is new (see `known`)."""
        self.clocks.gyro(stamp_us)
        previous = self._newest
        if previous is None:
            return self._begin(stamp_us, rates, Arrival.GAP)
        if self.restarted(stamp_us):
            self.counters.restarts += 1
            self._moments.clear()
            return self._begin(stamp_us, rates, Arrival.RESTART)
        missing, moments_missing = self._samples_missing(previous, stamp_us), self._moments_awaited()
        owed = self._owed + missing if missing else max(0, self._owed - 1)
        finished = None if self._spoilt else self._finish(previous, stamp_us, rates)
        if finished is None or owed > self._missing.samples or moments_missing > self._missing.moments:
            self.counters.gaps += 1
            return self._begin(stamp_us, rates, Arrival.GAP)._replace(finished=finished or ())
        self.counters.bridged += missing > 0 or moments_missing > 0
        self._newest, self._rates, self._owed, self.lost = stamp_us, rates, owed, missing
        self.counters.stepped += len(finished)
        return Arrived(Arrival.NEXT, finished, self._rates_now(finished))

    def restarted(self, stamp_us: int) -> bool:
        """Whether a gyro stamp that is not `known` is one of a clock that has jumped back."""
        return self._newest is not None and stamp_us < self._newest

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

    def spoil_gyro(self, stamp_us: int) -> None:
        """The gyro sample of a new stamp cannot be used; it counts as the newest all the same."""
        self._newest = stamp_us
        self.spoil()

    def _begin(self, stamp_us: int, rates: Axes3, arrival: Arrival) -> Arrived:
        self._newest, self._rates = stamp_us, rates
        self._grid, self._grid_rates = float(stamp_us), rates
        self._finished.clear()
        self._forget()
        self._owed, self._spoilt, self.lost = 0, False, 0
        return Arrived(arrival, (), rates)

    def _samples_missing(self, previous: int, stamp_us: int) -> int:
        """Gyro samples that should have come between two stamps."""
        return max(0, math.ceil((stamp_us - previous) / self._dt_us - WHOLE) - 1)

    def _moments_missing(self, point: float) -> int:
        """Moments that should have come by a grid point since the newest; 0 when none is known."""
        newest = self._moments[-1][0] if self._moments else point
        return max(0, math.ceil((point - newest) / self._dt_us - WHOLE))

    def _moments_awaited(self) -> int:
        """Moments that are missing, those included that have come while others behind them had not."""
        unknown = sum(rates != used for _, _, rates, (used, _) in self._finished)
        return max(self._moments_missing(self._grid), unknown + HELD if unknown else 0)

    def _finish(self, previous: int, stamp_us: int, rates: Axes3) -> tuple[Inputs, ...] | None:
        """The intervals up to `stamp_us`; None when no moment acts in them, or they are too many to put in."""
        ends = self._points_to(stamp_us)
        if len(ends) > AHEAD:
            return None
        moments = []
        for begin, end in pairwise([self._grid, *ends]):
            moment = self._mean_moment(begin, end)
            if moment is None:
                return None
            moments.append(moment)
        unknown = self._moments_missing(self._grid) > HELD and not self._samples_missing(previous, stamp_us)
        rates_at = self._rates_at(ends, moments, previous, stamp_us, rates)
        finished: list[Inputs] = []
        for end, moment, following in zip(ends, moments, rates_at, strict=True):
            used = self._model.expect(finished, moment) if unknown else self._grid_rates
            finished.append((used, moment))
            self._finished.append((self._grid, end, self._grid_rates, (used, moment)))
            self._grid, self._grid_rates = end, following
        return tuple(finished)

    def _rates_now(self, finished: tuple[Inputs, ...]) -> Axes3:
        """The rates to estimate by at the newest grid point."""
        if self._moments_missing(self._grid) <= HELD:
            return self._grid_rates
        return self._model.expect(finished, _whole(self._moments[-1]))

    def _rates_at(
        self, ends: list[float], moments: list[Axes3], previous: int, stamp_us: int, rates: Axes3
    ) -> list[Axes3]:
        """Rates at the grid points up to a sample: on the line between two that follow each other, else put in."""
        if (stamp_us - previous) / self._dt_us > 1.0 + WHOLE and ends:
            return self._model.bridge(self._grid_rates, moments, rates, (stamp_us - ends[-1]) / self._dt_us)
        shares = [(end - previous) / (stamp_us - previous) for end in ends]
        return [rates if share == 1.0 else _between(self._rates, rates, share) for share in shares]

    def _points_to(self, stamp_us: int) -> list[float]:
        """Grid points after the newest, up to a stamp; the last is the stamp itself when that is near enough."""
        points: list[float] = []
        grid = self._grid
        while len(points) <= AHEAD:
            point = grid + self._dt_us
            grid = float(stamp_us) if abs(point - stamp_us) <= self._tolerance_us else point
            if grid > stamp_us:
                break
            points.append(grid)
        return points

    def _mean_moment(self, begin: float, end: float) -> Axes3 | None:
        """Time mean of the moment over an interval; None when none acts at its begin.

        A moment acts until the next one. Where HELD or more are missing between two, the line between them is nearer to
        what has acted.
        """
        at_begin, before_end = begin + self._tolerance_us, end - self._tolerance_us
        first = sum(stamp <= at_begin for stamp, *_ in self._moments) - 1  # in order of their stamps
        last = sum(stamp < before_end for stamp, *_ in self._moments) - 1
        if first < 0:
            return None
        edges = [begin, *(float(stamp) for stamp, *_ in self._moments[first + 1 : last + 1]), end]
        pieces = [(b - a, self._acting(k, a, b)) for k, (a, b) in enumerate(pairwise(edges), start=first)]
        return pieces[0][1] if len(pieces) == 1 else _mean(pieces)

    def _acting(self, which: int, begin: float, end: float) -> Axes3:
        """Mean of one moment's part of an interval."""
        stamp, own, ours, late_us = self._moments[which]
        if which + 1 < len(self._moments):
            next_stamp, next_own, *_ = self._moments[which + 1]
            if late_us is not None or next_stamp - stamp > self._longest_held_us:
                own = _between(own, next_own, ((begin + end) / 2 - stamp) / (next_stamp - stamp))
        if late_us is None:
            return own
        before = self._moments[which - 1][2] if which else ours
        return _sum(own, _between(ours, before, min(max((stamp + late_us - begin) / (end - begin), 0.0), 1.0)))

    def _revised(self) -> Iterator[Revision]:
        """What the moments now known make of the finished intervals."""
        if not self._finished or self._moments_missing(self._finished[-1][0]) > HELD:
            return  # what the model expected of the newest intervals rests on the older ones: all at once, or none
        for at, (begin, end, rates, used) in enumerate(self._finished):
            moment = self._mean_moment(begin, end)
            if moment is not None and (rates, moment) != used:
                self._finished[at] = begin, end, rates, (rates, moment)
                yield len(self._finished) - 1 - at, _difference(rates, used[0]), _difference(moment, used[1])

    def _forget(self) -> None:
        """Drop the moments that no interval can need, neither to come nor to be revised."""
        oldest = self._finished[0][0] if self._finished else self._grid
        acting = sum(stamp <= oldest + self._tolerance_us for stamp, *_ in self._moments)
        del self._moments[: max(0, acting - 1)]


def _whole(moment: _Moment) -> Axes3:
    """Both parts."""
    return moment[1] if moment[3] is None else _sum(moment[1], moment[2])


def _sum(one: Axes3, other: Axes3) -> Axes3:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def _difference(after: Axes3, before: Axes3) -> Axes3:
    return after[0] - before[0], after[1] - before[1], after[2] - before[2]


def _between(before: Axes3, after: Axes3, share: float) -> Axes3:
    """The point on the line from `before` (share 0) to `after` (share 1)."""
    roll, pitch, yaw = (a + share * (b - a) for a, b in zip(before, after, strict=True))
    return roll, pitch, yaw


def _mean(pieces: list[tuple[float, Axes3]]) -> Axes3:
    """Mean of values, each with its weight."""
    whole = sum(weight for weight, _ in pieces)
    roll, pitch, yaw = (sum(weight * value[axis] for weight, value in pieces) / whole for axis in range(3))
    return roll, pitch, yaw

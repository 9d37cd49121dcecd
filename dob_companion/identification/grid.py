"""A record on one uniform grid, as the companion takes a link: the rate on the line between the two samples around a
grid point, the moment as the mean of what acted until the next.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dob_companion.identification.record import Facts, Floats, Record, Signal

HOLE = 3.5
"""A step of this many usual ones is a hole: three samples or more are missing."""

FASTEST_HZ = 500.0
FASTER = 1.2
"""A record this much faster than the rate asked for is taken at its own, up to FASTEST_HZ."""

HIGHEST = 0.4
"""Highest frequency that a signal shows, of the rate at which it comes: beyond, what folds down is near."""

LINE_POINTS = 8
"""Of a line, in the mean over an interval."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Timing:
    """How one signal came: its usual rate, shortest and longest usual step (1 % and 99 %), and its holes."""

    rate_hz: float
    steps_s: tuple[float, float]
    holes: tuple[tuple[float, float], ...]

    def said(self, name: str) -> str:
        """One line for a user."""
        low, high = (1e3 * step for step in self.steps_s)
        line = f"{name}: {self.rate_hz:.4g} Hz, steps of {low:.3g} to {high:.3g} ms"
        if self.holes:
            longest = max(end - begin for begin, end in self.holes)
            line += f", {len(self.holes)} hole{'s' * (len(self.holes) > 1)}, the longest of {longest:.2g} s"
        return line


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """All signals at n points `begin` + k dt; what does not come with the record is None.

    moment, injected: means from each point to the next. known: neither rate nor moment stands in a hole.
    Instruments are 0 where nothing is known of them.
    """

    begin: float
    dt: float
    rates: Floats
    moment: Floats
    known: Flags
    injected: Floats | None
    attitude_setpoint: Floats | None
    rate_setpoint: Floats | None
    gyro_timing: Timing
    moment_timing: Timing

    @property
    def time(self) -> Floats:
        """s on the record's clock, shape (n,)."""
        return np.asarray(self.begin + self.dt * np.arange(len(self.known)), float)

    @property
    def rate_hz(self) -> float:
        """Points a second."""
        return 1.0 / self.dt

    @property
    def highest_hz(self) -> float:
        """Highest frequency that is looked at: of a record that was put on a finer grid, what its own samples show."""
        return HIGHEST * min(self.rate_hz, self.gyro_timing.rate_hz, self.moment_timing.rate_hz)


def timing(signal: Signal) -> Timing:
    """Of a signal with at least three times."""
    steps = np.diff(signal.time)
    usual = float(np.median(steps))
    holes = np.flatnonzero(steps > HOLE * usual)
    low, high = np.quantile(steps[steps <= HOLE * usual], [0.01, 0.99])
    spans = tuple((float(signal.time[k]), float(signal.time[k + 1])) for k in holes)
    # Steps that alternate (2.5, 5 ms) have a mean that says more than their median.
    mean = float(np.mean(steps[steps <= HOLE * usual]))
    return Timing(1.0 / mean, (float(low), float(high)), spans)


def grid_rate(gyro: Timing, moment: Timing, rate_hz: float) -> float:
    """The rate asked for, or the record's own where that is clearly higher."""
    own = min(gyro.rate_hz, moment.rate_hz, FASTEST_HZ)
    return float(np.round(own, 1)) if own > FASTER * rate_hz else rate_hz


def gridded(record: Record, rate_hz: float, *, exactly: bool = False) -> Grid:
    """The record at `rate_hz`, or at its own rate where that is clearly higher, unless `exactly`.

    Rates and moment must have three times or more, and overlap by more than a few steps (see `overlap`).
    """
    gyro, moment = timing(record.rates), timing(record.moment)
    dt = 1.0 / (rate_hz if exactly else grid_rate(gyro, moment, rate_hz))
    begin, end = overlap(record)
    # On the gyro's own stamps where these are regular.
    begin = float(record.rates.time[np.searchsorted(record.rates.time, begin)])
    count = int(np.floor((end - begin) / dt + 1e-6))
    points: Floats = np.asarray(begin + dt * np.arange(count + 1), float)
    starts = points[:-1]
    known = np.ones(count, bool)
    for hole_begin, hole_end in (*gyro.holes, *moment.holes):
        first, last = np.searchsorted(points, [hole_begin - 1e-9, hole_end + 1e-9])
        known[max(0, first - 1) : last] = False
    return Grid(
        begin=begin,
        dt=dt,
        rates=_between(record.rates, starts),
        moment=_acting(record, points),
        known=known,
        injected=_mean(_injected(injected, record), points) if (injected := _there(record.injected)) else None,
        attitude_setpoint=_held(_unwrapped(attitude), starts)
        if (attitude := _there(record.attitude_setpoint))
        else None,
        rate_setpoint=_held(rate, starts) if (rate := _there(record.rate_setpoint)) else None,
        gyro_timing=gyro,
        moment_timing=moment,
    )


def overlap(record: Record) -> tuple[float, float]:
    """Begin and end of what rates and moment have in common, s."""
    signals = record.rates, record.moment
    return float(max(s.time[0] for s in signals)), float(min(s.time[-1] for s in signals))


def holding(facts: Facts | None, time: Floats, unknown: bool) -> Flags:
    """What holds at these times; `unknown` where the source does not tell at all."""
    return np.full(len(time), unknown) if facts is None or not len(facts.time) else facts.at(time)


def runs(flags: Flags) -> Iterator[tuple[int, int]]:
    """First and one past the last index of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def _there(signal: Signal | None) -> Signal | None:
    return signal if signal is not None and len(signal.time) > 2 else None


def _between(signal: Signal, at: Floats) -> Floats:
    return np.column_stack([np.interp(at, signal.time, channel) for channel in signal.values.T])


def _acting(record: Record, points: Floats) -> Floats:
    """Mean of the moment over the intervals between the points.

    Where a program beside the controller has read it, less often than the controller makes a new one, holding what it
    read would be late by half the time between two, and in a closed loop that looks like another plant.
    """
    if record.moment_read_late_s is None or record.injected is None:
        return _mean(record.moment, points)
    time, injected = record.moment.time, record.injected
    own = record.moment.values - _held(injected, time)
    width = np.diff(points)[:, None]
    shares = (np.arange(LINE_POINTS) + 0.5) / LINE_POINTS
    line = np.mean([_between(Signal(time, own), points[:-1] + share * width[:, 0]) for share in shares], axis=0)
    return np.asarray(line + _mean(_injected(injected, record), points))


def _injected(signal: Signal, record: Record) -> Signal:
    """When it acts."""
    return _silenced(Signal(signal.time + (record.moment_read_late_s or 0.0), signal.values))


def _mean(signal: Signal, points: Floats) -> Floats:
    """Mean of a signal that holds each value until the next, over the intervals between the points."""
    whole = np.vstack([np.zeros(signal.values.shape[1]), np.cumsum(
        signal.values[:-1] * np.diff(signal.time)[:, None], axis=0)])  # fmt: skip
    beyond = max(points[-1] - signal.time[-1], 0.0) + 1.0
    time = np.concatenate(([min(points[0], signal.time[0]) - 1.0], signal.time, [signal.time[-1] + beyond]))
    whole = np.vstack([whole[:1], whole, whole[-1:] + beyond * signal.values[-1:]])
    at = np.column_stack([np.interp(points, time, channel) for channel in whole.T])
    return np.asarray(np.diff(at, axis=0) / np.diff(points)[:, None], float)


def _silenced(signal: Signal) -> Signal:
    """Zero from the usual step on where no next one comes: an instrument may be anything, so nothing."""
    usual = float(np.median(np.diff(signal.time)))
    at = np.flatnonzero(np.diff(signal.time, append=np.inf) > HOLE * usual)
    zeros = np.zeros((len(at), signal.values.shape[1]))
    return Signal(
        np.insert(signal.time, at + 1, signal.time[at] + usual), np.insert(signal.values, at + 1, zeros, axis=0)
    )


def _unwrapped(signal: Signal) -> Signal:
    return Signal(signal.time, np.unwrap(signal.values, axis=0))


def _held(signal: Signal, at: Floats) -> Floats:
    """The last value, 0 before the first."""
    last = np.searchsorted(signal.time, at + 1e-9, side="right") - 1
    return np.where(last[:, None] >= 0, signal.values[np.maximum(last, 0)], 0.0)

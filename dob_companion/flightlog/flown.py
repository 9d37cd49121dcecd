"""A flight that is over: its clock, the holes in it, and how to tell many changes shortly. Pure."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dob_companion.supervisor import State

Array = NDArray[np.float64]

HOLE_SAMPLES = 2.5
"""An interval of so many sample times is a hole, not a sample that came late."""

LONGEST_HOLE_S = 3600.0
"""A vehicle's clock that goes on by more was set anew."""


@dataclass(frozen=True, slots=True)
class Change:
    """A change of state, s of flight time, and its reason in words."""

    time: float
    state: State
    reason: str


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter has this value from `time` on, s of flight time; -inf where it had it from the start."""

    time: float
    name: str
    value: float


@dataclass(frozen=True, slots=True)
class Happening:
    """The same change of state, `times` in all, from `first` to `last` in s of flight time."""

    first: float
    last: float
    times: int
    state: State
    reason: str


class FlightClock:
    """Flight time: s since the first sample, by the vehicle's clock as long as that goes on.

    Where it jumps, as after a reboot, the daemon's clock tells how long it was; and so it does before the first
    sample and after the last. `came` (N,) in s of the daemon's clock, `stamp_us` (N,) of the samples; N is 1 at least.
    """

    def __init__(self, came: ArrayLike, stamp_us: NDArray[np.int64]) -> None:
        self._came: Array = np.asarray(came, dtype=np.float64)
        steps = np.diff(stamp_us) * 1e-6
        jumped = (steps < 0.0) | (steps > LONGEST_HOLE_S)
        self.time: Array = np.concatenate(([0.0], np.cumsum(np.where(jumped, np.diff(self._came), steps))))
        """(N,) of each sample"""
        self.restarts: tuple[float, ...] = tuple(self.time[1:][jumped].tolist())
        """when the vehicle's clock began anew"""

    def at(self, wall: ArrayLike) -> Array:
        """Flight time of moments of the daemon's clock."""
        moments = np.asarray(wall, dtype=np.float64)
        before = np.minimum(moments - self._came[0], 0.0)
        after = np.maximum(moments - self._came[-1], 0.0)
        return np.asarray(np.interp(moments, self._came, self.time) + before + after)


def holes(time: Array) -> NDArray[np.bool_]:
    """(N - 1,) Which intervals between samples are holes."""
    steps = np.diff(time)
    usual = steps[steps > 0.0]
    return steps > HOLE_SAMPLES * float(np.median(usual)) if usual.size else np.zeros(len(steps), dtype=np.bool_)


def with_holes(time: Array, values: Array) -> tuple[Array, Array]:
    """The same trace with a NaN in every hole, so that no line is drawn across it. `time`, `values` (N,)."""
    ends = np.flatnonzero(holes(time)) + 1
    return np.insert(time, ends, 0.5 * (time[ends] + time[ends - 1])), np.insert(values, ends, np.nan)


def happenings(changes: Sequence[Change]) -> list[Happening]:
    """Changes of the same kind together, in the order of their first; numbers in a reason do not make it another."""
    found: dict[tuple[State, str], list[Change]] = {}
    for change in changes:
        found.setdefault((change.state, re.sub(r"\d+(\.\d+)?", "#", change.reason)), []).append(change)
    return [
        Happening(same[0].time, same[-1].time, len(same), same[0].state, _reason(change.reason for change in same))
        for same in found.values()
    ]


def _reason(reasons: Iterable[str]) -> str:
    """The reason, or the first of several that differ in their numbers only."""
    first, *others = dict.fromkeys(reasons)
    return f"{first}, and the like" if others else first

"""Signals as a file holds them, and what becomes of them: cut where a clock begins anew, put in order, cleaned.

A file is read in its own order. Stamps that go back by more than BACK_S, or on by more than an hour, and stay there are
a clock that began anew (a reboot, a clock that was set): there a record ends. A few stamps far from those around them
are none: they are dropped. What is left is put in order, and of equal stamps the first is kept.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dob_companion.flightlog.flown import LONGEST_HOLE_S
from dob_companion.identification.record import Floats, Signal

BACK_S = 1.0
"""A stamp older by more is no disorder."""

FAR_S = 60.0
"""At either end of a file, a few stamps that are farther from the rest than this are none."""

_STRAYS = 3
"""So many stamps in a row, far from those around them, are wrong; more are a clock of their own."""

_EPOCH = 1 << 50
"""µs: more than any clock reaches."""

_HOLE = 4.0
"""A step longer than so many usual ones is a hole."""


@dataclass(frozen=True, slots=True)
class Series:
    """A signal as a file holds it, in the file's order.

    place   (n,) where in the file, rising: a byte, a line, the number of an entry
    time    (n,) s of the source's clock, in any order
    values  (n, channels), maybe not finite
    """

    place: NDArray[np.int64]
    time: Floats
    values: Floats

    @classmethod
    def of(cls, place: ArrayLike, time: ArrayLike, values: ArrayLike) -> "Series":
        """From lists or arrays; one channel may come as a row of numbers."""
        table = np.asarray(values, dtype=np.float64)
        return cls(
            np.asarray(place, dtype=np.int64),
            np.asarray(time, dtype=np.float64),
            table.reshape(len(table), -1) if table.size else table.reshape(0, 1),
        )

    def where(self, keep: NDArray[np.bool_] | NDArray[np.int64]) -> "Series":
        """Some of it."""
        return Series(self.place[keep], self.time[keep], self.values[keep])

    def within(self, begin: int, end: int) -> "Series":
        """What stands in the file from place `begin` to before `end`."""
        first, last = np.searchsorted(self.place, (begin, end))
        return Series(self.place[first:last], self.time[first:last], self.values[first:last])

    @property
    def rate_hz(self) -> float:
        """The usual rate; 0 where there are fewer than two samples."""
        steps = np.diff(np.sort(self.time[np.isfinite(self.time)]))
        steps = steps[steps > 0.0]
        return 1.0 / float(np.median(steps)) if steps.size else 0.0


def joined(parts: list[Series]) -> Series:
    """The same signal from several sources, in the file's order."""
    order = np.argsort(np.concatenate([part.place for part in parts]), kind="stable")
    place, time, values = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("place", "time", "values")
    )
    return Series(place[order], time[order], values[order])


def both(one: Series, other: Series) -> Series:
    """Where both hold, of two that are 0 or 1 from each place on until the next; the first counts before it."""
    place = np.unique(np.concatenate((one.place, other.place)))
    time = np.empty(len(place))
    for series in (one, other):
        time[np.searchsorted(place, series.place)] = series.time
    return Series(place, time, np.minimum(*(_held(each, place) for each in (one, other))))


def _held(series: Series, at: NDArray[np.int64]) -> Floats:
    return series.values[np.maximum(np.searchsorted(series.place, at, side="right") - 1, 0)]


def places_by_time(time: Floats) -> NDArray[np.int64]:
    """Places for a file whose own order says nothing: by the stamps, clock after clock."""
    sound = np.flatnonzero(np.isfinite(time) & ~strays(np.nan_to_num(time, nan=-1.0)))
    epoch = np.zeros(len(time), np.int64)
    for at in _restarts(time[sound]):
        epoch[sound[at] :] += 1
    reached = np.zeros(len(time))
    for number in range(int(epoch[-1]) + 1 if len(epoch) else 0):
        these = sound[epoch[sound] == number]
        reached[these] = np.maximum.accumulate(time[these])
    micros = np.round(1e6 * np.maximum(reached, 0.0)).astype(np.int64)
    return np.maximum.accumulate(epoch * _EPOCH + micros)


def spans(main: Series, witnesses: list[Series]) -> list[tuple[int, int]]:
    """Places from which on, and before which, one clock holds.

    That it began anew is told by `main`; where, between two of its samples, by `witnesses` as well.
    """
    clock = main.where(np.isfinite(main.time))
    clock = clock.where(~strays(clock.time))
    restarts = []
    for at in _restarts(clock.time):
        before, place = int(clock.place[at - 1]), int(clock.place[at])
        between = [w.within(before + 1, place) for w in witnesses]
        anew = [w.place[_jumped(w.time - clock.time[at - 1])] for w in between]
        restarts.append(min([place, *(int(places[0]) for places in anew if len(places))]))
    return list(pairwise([0, *restarts, np.iinfo(np.int64).max]))


def strays(time: Floats) -> NDArray[np.bool_]:
    """Which stamps are wrong: a few, far from those before and after them."""
    found = np.zeros(len(time), dtype=np.bool_)
    if len(time) < 2:
        return found
    steps = np.abs(np.diff(time))
    leap = max(BACK_S, 20.0 * float(np.median(steps)))
    edges = [0, *(np.flatnonzero(steps > leap) + 1).tolist(), len(time)]
    if len(edges) > 2:
        for before, (begin, end) in zip([None, *pairwise(edges)], pairwise(edges), strict=False):
            if end - begin <= _STRAYS and len(time) - found.sum() > _STRAYS:
                last = time[before[1] - 1] if before else None
                after = time[end] if end < len(time) else None
                found[begin:end] = _astray(float(time[begin]), float(time[end - 1]), last, after)
    return found


def _astray(begin: float, end: float, before: float | None, after: float | None) -> bool:
    if before is None:
        return after is not None and (end > after or after - end > FAR_S)
    if after is None:
        return begin < before or begin - before > FAR_S
    return (begin < before or end > after) and not before > after


def _restarts(time: Floats) -> list[int]:
    """Where the clock begins anew."""
    found: list[int] = (np.flatnonzero(_jumped(np.diff(time))) + 1).tolist()
    return found


def _jumped(steps: Floats) -> NDArray[np.bool_]:
    return (steps < -BACK_S) | (steps > LONGEST_HOLE_S)


def signal(series: Series) -> tuple[Signal, list[str]]:
    """One signal of one clock in order, and what had to be done for it, in words."""
    said = []
    finite = np.isfinite(series.time) & np.isfinite(series.values).all(axis=1)
    if lost := len(finite) - int(finite.sum()):
        said.append(f"{_samples(lost)} not finite: dropped")
        series = series.where(finite)
    wrong = strays(series.time)
    if wrong.any():
        said.append(f"{_samples(int(wrong.sum()))} with a stamp far from the rest: dropped")
        series = series.where(~wrong)
    if late := int((np.diff(series.time) < 0.0).sum()):
        said.append(f"stamps go back {late} times: put in order")
    order = np.argsort(series.time, kind="stable")
    time, values = series.time[order], series.values[order]
    first = np.concatenate(([True], np.diff(time) > 0.0)) if len(time) else np.zeros(0, dtype=np.bool_)
    if double := len(first) - int(first.sum()):
        said.append(f"{_samples(double)} with the stamp of another: dropped")
    time, values = time[first], values[first]
    steps = np.diff(time)
    holes = steps[steps > _HOLE * np.median(steps)] if steps.size else steps
    if holes.size:
        said.append(f"{_counted(holes.size, 'hole')} of up to {holes.max():.3g} s")
    return Signal(time, values), said


def _samples(count: int) -> str:
    return _counted(count, "sample")


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" + "s" * (count != 1)

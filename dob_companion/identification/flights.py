"""Several records of one aircraft, one behind the other on one grid, so that their spectra are averaged as one's are.

No window crosses from one to the next. Before that: whether they can be of one aircraft at all, by what they say.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from dob_companion.identification.agreement import Shift
from dob_companion.identification.grid import Grid, Timing, grid_rate, gridded, timing
from dob_companion.identification.known import Known, known
from dob_companion.identification.record import Floats, Record
from dob_companion.identification.result import Interval
from dob_companion.identification.segments import HOLE, states

APART, LATE_S = 0.2, 0.006
"""Largest difference of gains, relative, and of delays that one aircraft may show from flight to flight."""

NORMAL_95 = 1.96


@dataclass(frozen=True, slots=True)
class Flights:
    """`ends`: of each record on the grid, one past its last point. `state`: as `segments.states`, of all."""

    grid: Grid
    state: np.ndarray
    ends: tuple[int, ...]
    grids: tuple[Grid, ...]

    @property
    def begins_s(self) -> tuple[float, ...]:
        """Where each record begins on the clock of the grid, s."""
        firsts = (0, *self.ends[:-1])
        return tuple(float(self.grid.begin + first * self.grid.dt) for first in firsts)


def joined(records: Sequence[Record], rate_hz: float) -> Flights:
    """At `rate_hz`, or at the own rate of the slowest where that is clearly higher."""
    own = min(grid_rate(timing(each.rates), timing(each.moment), rate_hz) for each in records)
    grids = tuple(gridded(record, own, exactly=True) for record in records)
    state = [states(record, grid) for record, grid in zip(records, grids, strict=True)]
    ends = tuple(int(end) for end in np.cumsum([len(grid.known) for grid in grids]))
    if len(grids) == 1:
        return Flights(grids[0], state[0], ends, grids)
    known = np.concatenate([grid.known for grid in grids])
    whole = np.concatenate(state)
    for end in ends[:-1]:  # a window, or a step of an instrument, over the seam would be of no flight
        known[end - 1 : end + 1] = False
        whole[end - 1 : end + 1] = HOLE
    grid = replace(
        grids[0],
        rates=np.concatenate([grid.rates for grid in grids]),
        moment=np.concatenate([grid.moment for grid in grids]),
        known=known,
        gyro_timing=_slowest(grid.gyro_timing for grid in grids),
        moment_timing=_slowest(grid.moment_timing for grid in grids),
        injected=_together([grid.injected for grid in grids], grids),
        attitude_setpoint=_together([grid.attitude_setpoint for grid in grids], grids),
        rate_setpoint=_together([grid.rate_setpoint for grid in grids], grids),
    )
    return Flights(grid, whole, ends, grids)


def _slowest(timings: Iterable[Timing]) -> Timing:
    return min(timings, key=lambda one: one.rate_hz)


def _together(parts: Sequence[Floats | None], grids: Sequence[Grid]) -> Floats | None:
    if all(part is None for part in parts):
        return None
    return np.concatenate(
        [np.zeros_like(grid.rates) if part is None else part for part, grid in zip(parts, grids, strict=True)]
    )


def contradiction(records: Sequence[Record]) -> str:
    """What the records say of the aircraft that cannot be true of one; "" where nothing is."""
    first = records[0]
    for other in records[1:]:
        for what, one, two in (
            ("autopilot", first.make, other.make),
            ("vehicle", first.vehicle, other.vehicle),
        ):
            if one and two and one != two:
                return f"{first.source} is of {what} {one!r}, {other.source} of {two!r}: not one aircraft"
        if first.rates_filtered is not other.rates_filtered:
            return (
                f"the rates of {first.source} and {other.source} are not taken at the same side of the gyro filter: "
                "identify from logs of one kind"
            )
    return ""


def known_together(records: Sequence[Record], axis: str) -> tuple[Known, str]:
    """What the newest record's parameters say, and why the others do not go with it; "" where they do."""
    every = [known(record, axis) for record in records]
    newest = every[-1]
    for record, said in zip(records, every, strict=True):
        if (said.in_record, said.in_link, said.late_s) != (newest.in_record, newest.in_link, newest.late_s):
            return newest, (
                f"{record.source} and {records[-1].source} were flown with different gyro filters "
                f"({_words(said)}; {_words(newest)}): identify each by itself"
            )
    return newest, ""


def _words(said: Known) -> str:
    return ", ".join(said.about) or "none"


def parts(spans: Sequence[tuple[int, int]], ends: Sequence[int]) -> list[tuple[float, float]]:
    """What each record has of these stretches of the grid, in samples of all stretches (see `spectra.Level`)."""
    found, first, done = [], 0, 0
    for end in ends:
        here = sum(b - a - 1 for a, b in spans if first <= a < end)
        found.append((float(done), float(done + here)))
        first, done = end, done + here
    return found


@dataclass(frozen=True, slots=True)
class Between:
    """How records differ beyond what is known of each: relative standard deviation of the gain, that of the delay in
    s, and why they cannot be of one aircraft ("" where they can)."""

    gain: float = 0.0
    delay_s: float = 0.0
    why: str = ""


def compared(shifts: Sequence[tuple[str, Shift]]) -> Between:
    """Of the records by their sources, each against one model."""
    gains, delays = [one.gain for _, one in shifts], [one.delay_s for _, one in shifts]
    for what, values, unit, most, scale in (("gain", gains, "", APART, 1.0), ("delay", delays, " ms", LATE_S, 1e3)):
        low, high = min(values, key=lambda x: x.value), max(values, key=lambda x: x.value)
        if high.value - low.value > most and low.high < high.low:
            said = ", ".join(
                f"{source} {scale * x.value:+.3g} ({scale * x.low:+.3g} to {scale * x.high:+.3g}){unit}"
                for (source, _), x in zip(shifts, values, strict=True)
            )
            off = "of the common model's" if what == "gain" else "beyond the common model's"
            return Between(
                why=f"the records contradict each other: {what} {off} {said}: payload, propellers, battery or settings "
                "changed; identify each by itself"
            )
    return Between(_excess(gains), _excess(delays))


def _excess(values: Sequence[Interval]) -> float:
    """Standard deviation of numbers beyond what their intervals say; 0 where these explain it."""
    if len(values) < 2:
        return 0.0
    x = np.array([each.value for each in values])
    own = (np.array([each.high - each.low for each in values]) / (2.0 * NORMAL_95)) ** 2
    weight = 1.0 / own
    mean = float(np.sum(weight * x) / np.sum(weight))
    if float(np.sum(weight * (x - mean) ** 2)) < float(chi2.ppf(0.95, len(x) - 1)):
        return 0.0
    return float(np.sqrt(max(0.0, float(np.var(x, ddof=1)) - float(np.mean(own)))))

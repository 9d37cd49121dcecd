"""A recorded flight in numbers: time in each state, link and loop, and gyro rates without and with the observer.

The last two are compared by their spectra (P. D. Welch, IEEE Trans. Audio Electroacoust. 15(2), 1967), so that a band
in which the observer cannot help does not hide one in which it does. Nothing here knows the disturbance.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from dob_companion.analysis.recorded import Array, RecordedFlight
from dob_companion.flightlog.flown import HOLE_SAMPLES, holes
from dob_companion.supervisor import State

OFF_STATES = (State.DISABLED, State.TRACKING)
ON_STATES = (State.ACTIVE,)
BANDS_HZ = ((0.25, 1.0), (1.0, 5.0), (5.0, 10.0), (10.0, 25.0), (25.0, 50.0))

STRETCH = 1024
"""Samples of one periodogram: 4 s at 250 Hz, a resolution of a quarter of a hertz."""


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Power spectral density of the gyro rates in one mode. `density` (F, 3) in (rad/s)²/Hz over `hz` (F,)."""

    seconds: float
    hz: Array
    density: Array

    def rms(self, band: tuple[float, float] | None = None) -> Array:
        """Root mean square of each axis, rad/s, within a band or above its mean value."""
        low, high = band or (0.0, np.inf)
        within = (self.hz > low if band is None else self.hz >= low) & (self.hz < high)
        step = self.hz[1] - self.hz[0]
        power: Array = np.sqrt(self.density[within].sum(axis=0) * step)
        return power

    def over(self, other: "Spectrum", band: tuple[float, float] | None = None) -> Array:
        """The RMS of each axis over that of another spectrum; NaN where the other is zero."""
        mine, others = self.rms(band), other.rms(band)
        ratio: Array = np.divide(mine, others, out=np.full(mine.shape, np.nan), where=others > 0.0)
        return ratio


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantiles:
    """Of how often something took how long."""

    median: float
    p99: float
    most: float

    @classmethod
    def of(cls, values: Array) -> "Quantiles | None":
        """Of the values (N,) that are finite; None when there is none."""
        known = values[np.isfinite(values)]
        if not known.size:
            return None
        return cls(median=float(np.median(known)), p99=float(np.percentile(known, 99)), most=float(np.max(known)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """A flight in a few numbers.

    samples, answered     gyro samples, and those that a correction answers
    rate_hz               mean sample rate on the vehicle's stamps, holes left out
    holes                 in the samples; without_samples_s is how long all of them were, with what follows the last one
    age_samples, turn_s   age of a correction when it acts, and wall time of the loop's turns; None where unknown
    largest               component of a correction, normalized torque; NaN without any
    """

    samples: int
    answered: int
    rate_hz: float
    holes: int
    without_samples_s: float
    age_samples: Quantiles | None
    turn_s: Quantiles | None
    largest: float


def summary(flight: RecordedFlight) -> Summary:
    """The numbers of a flight."""
    steps, corrections = intervals_ms(flight), flight.correction
    usual = steps[steps <= HOLE_SAMPLES * float(np.median(steps))]
    return Summary(
        samples=len(flight.time),
        answered=int(np.sum(np.all(np.isfinite(corrections), axis=1))),
        rate_hz=1e3 / float(np.mean(usual)),
        holes=int(holes(flight.time).sum()),
        without_samples_s=without_samples(flight),
        age_samples=Quantiles.of(flight.ages),
        turn_s=Quantiles.of(flight.took),
        largest=float(np.nanmax(np.abs(corrections))) if np.any(np.isfinite(corrections)) else float("nan"),
    )


def time_in_states(flight: RecordedFlight) -> dict[State, float]:
    """Seconds in each state that occurred, while samples came; holes count for none."""
    lengths = np.where(holes(flight.time), 0.0, np.diff(flight.time))
    return {state: float(lengths[flight.state[:-1] == state].sum()) for state in State if np.any(flight.state == state)}


def without_samples(flight: RecordedFlight) -> float:
    """Seconds of the recording in which no samples came: holes, and what follows the last one."""
    return float(np.diff(flight.time)[holes(flight.time)].sum() + flight.seconds - flight.time[-1])


def spectrum(flight: RecordedFlight, states: tuple[State, ...]) -> Spectrum | None:
    """The gyro's spectrum while flying in these states; None when no stretch is long enough."""
    chosen = np.isin(flight.state, states) & flight.flying & np.all(np.isfinite(flight.gyro), axis=1)
    interval = _interval_s(flight)
    total, samples = np.zeros((STRETCH // 2 + 1, 3)), 0
    for rows in _stretches(flight.stamp_us, chosen, HOLE_SAMPLES * interval):
        time = 1e-6 * (flight.stamp_us[rows] - flight.stamp_us[rows.start])
        grid = np.arange(0.0, time[-1], interval)
        if len(grid) < STRETCH:
            continue
        even = np.column_stack([np.interp(grid, time, flight.gyro[rows, axis]) for axis in range(3)])
        total += len(grid) * welch(even, 1.0 / interval, nperseg=STRETCH, axis=0)[1]
        samples += len(grid)
    if not samples:
        return None
    hz: Array = np.fft.rfftfreq(STRETCH, interval).astype(np.float64)
    return Spectrum(samples * interval, hz, total / samples)


def intervals_ms(flight: RecordedFlight) -> Array:
    """Intervals between gyro stamps on the vehicle's clock, holes included; those of a restarted clock are left out."""
    steps: Array = np.diff(flight.stamp_us) * 1e-3
    return steps[steps > 0.0]


def _interval_s(flight: RecordedFlight) -> float:
    return float(np.median(intervals_ms(flight))) * 1e-3


def _stretches(stamp_us: NDArray[np.int64], chosen: NDArray[np.bool_], gap_s: float) -> list[slice]:
    """Runs of chosen samples without a gap between them."""
    steps = np.diff(stamp_us) * 1e-6
    broken = (steps <= 0.0) | (steps > gap_s) | (np.diff(chosen.astype(np.int8)) != 0)
    edges = [0, *(np.flatnonzero(broken) + 1).tolist(), len(stamp_us)]
    return [slice(a, b) for a, b in pairwise(edges) if chosen[a]]

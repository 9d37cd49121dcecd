"""What moves the aircraft and what the gyro adds: spectra of disturbance and noise, given the plant.

y = G (u + d) + n, so y - G u = G d + n whatever the controller does. Its spectrum, averaged over windows, is fitted by
d white noise through a first-order low-pass and n white noise through the known gyro filter, with the likelihood of
an averaged periodogram (Whittle, Ark. Mat. 2, 1953; Brillinger, *Time Series*, 1981, section 5.4). y and u are
differenced first, so that what turns slowly does not leak into every frequency.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from dob_companion.artifact import AXES
from dob_companion.identification.flights import joined
from dob_companion.identification.grid import Grid, runs
from dob_companion.identification.record import Record
from dob_companion.identification.result import AxisModel, Identification, Interval, Segment
from dob_companion.identification.segments import WORDS

Floats = NDArray[np.float64]

WINDOW_S = 8.0
"""Length of a window, s: its lowest useful frequencies are below those of wind that a rate loop is bothered by."""

LEAST_WINDOWS = 3
LOWEST_LINE = 2
"""Lines of a window below this are those of its ends."""

BAND = 0.5
"""Share of half the rate up to which is looked: an observer acts below it, motors shake above it."""

CORNERS_HZ = 0.05, 20.0
"""Within these the corner of a disturbance is looked for."""

NORMAL_95 = 1.96
SHARED = 0.6
"""Independent windows per half-overlapping Hann window."""

UNKNOWN = 5.0
"""Half the logarithm of an interval that says nothing."""

STARTS = 5
SMALLEST = 1e-9


SHOWN, LEAST_SHOWN, SHOWN_HZ = 4.0, 0.003, (0.1, 5.0)
"""A corner counts as seen when its interval is narrower than this factor, the disturbance's rms above this share of the
torque, and the corner within these Hz: beyond, it is what the model of the plant leaves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What an axis was exposed to while it was recorded, at 95 %.

    noise_rms         gyro noise, white up to half the rate, rad/s (before the gyro filter, where that is known)
    disturbance_rms   normalized torque
    corner_hz         of the low-pass that the disturbance looks like
    windows           averaged
    """

    noise_rms: Interval
    disturbance_rms: Interval
    corner_hz: Interval
    windows: int

    @property
    def shows_corner(self) -> bool:
        """Whether the disturbance was strong enough to show its spectrum."""
        low, high = SHOWN_HZ
        corner = self.corner_hz
        narrow = corner.high < SHOWN * corner.low and low < corner.value < high
        return narrow and self.disturbance_rms.value > LEAST_SHOWN


def surroundings(
    stretches: list[tuple[Floats, Floats]], model: AxisModel, rate_hz: float, *, window_s: float = WINDOW_S
) -> Surroundings | None:
    """Fit the spectra to stretches of (rate in rad/s, torque), each of shape (n,), on the grid of `rate_hz`.

    None where they are too short for LEAST_WINDOWS windows.
    """
    size = int(window_s * rate_hz)
    lines = np.arange(LOWEST_LINE, int(BAND * size / 2))
    frequency = 2.0 * np.pi * rate_hz * lines / size
    plant = model.response(frequency, rate_hz)
    taper = np.hanning(size)
    power, count = np.zeros(len(lines)), 0
    for rate, torque in stretches:
        dy, du = np.diff(rate), np.diff(torque)
        for begin in range(0, len(dy) - size + 1, size // 2):
            here = slice(begin, begin + size)
            turned, driven = (np.fft.rfft(taper * x[here])[lines] for x in (dy, du))
            power += np.abs(turned - plant * driven) ** 2
            count += 1
    if count < LEAST_WINDOWS:
        return None
    density = 2.0 * power / (count * rate_hz * float(np.sum(taper**2)))
    differenced = np.abs(1.0 - np.exp(-1j * frequency / rate_hz)) ** 2
    gyro = np.abs(model.filters.response(frequency)) ** 2
    return _fitted(density / differenced, np.abs(plant) ** 2, gyro, frequency, rate_hz, count)


def around(records: Record | Sequence[Record], found: Identification) -> dict[str, Surroundings | None]:
    """As `surroundings`, by axis; None where there is no model."""
    if all(result.model is None for result in found.axes.values()):
        return dict.fromkeys(found.axes)
    grid = joined((records,) if isinstance(records, Record) else records, found.rate_hz).grid
    flown = [segment for segment in found.segments if segment.why not in WORDS.values()]
    return {axis: _around(grid, flown, axis, result.model) for axis, result in found.axes.items()}


def _around(grid: Grid, flown: Sequence[Segment], axis: str, model: AxisModel | None) -> Surroundings | None:
    """Over the parts of a flight in which this axis was not excited; where these are too short, over those in which it
    was: what the model leaves of the excitation then counts as a disturbance."""
    if model is None:
        return None
    calm = [segment for segment in flown if axis not in segment.axes]
    for segments in (calm, flown):
        seen = surroundings(_stretches(grid, segments, AXES.index(axis)), model, grid.rate_hz)
        if seen is not None:
            return seen
    return None


def _stretches(grid: Grid, segments: Sequence[Segment], index: int) -> list[tuple[Floats, Floats]]:
    within = np.zeros(len(grid.known), bool)
    for segment in segments:
        within |= (grid.time >= segment.begin) & (grid.time < segment.end)
    return [(grid.rates[a:b, index], grid.moment[a:b, index]) for a, b in runs(within & grid.known)]


def _fitted(
    density: Floats, plant: Floats, gyro: Floats, frequency: Floats, rate_hz: float, windows: int
) -> Surroundings:
    """By logarithms of noise rms, disturbance rms and corner (rad/s); densities one-sided, per Hz."""
    independent = max(1.0, SHARED * windows)

    def low_passed(corner: float) -> Floats:
        """Density of a disturbance of unit rms, as the gyro shows it."""
        return plant * 4.0 * corner / (corner**2 + frequency**2)

    def expected(p: Floats) -> Floats:
        noise, rms, corner = np.exp(p)
        return np.asarray(2.0 / rate_hz * noise**2 * gyro + rms**2 * low_passed(corner))

    def cost(p: Floats) -> float:
        model = expected(p)
        return float(independent * np.sum(np.log(model) + density / model))

    low, high = (2.0 * np.pi * hz for hz in CORNERS_HZ)
    quiet, loud = slice(len(density) * 3 // 4, None), slice(len(density) // 4)
    noise = np.sqrt(np.median(density[quiet] / gyro[quiet]) * rate_hz / 2.0)
    bounds = [(-25.0, 5.0), (-25.0, 5.0), (np.log(low), np.log(high))]
    found = []
    for corner in np.geomspace(low, high, STARTS):
        rms = np.sqrt(np.median(density[loud] / low_passed(corner)[loud]))
        start = np.log([max(noise, SMALLEST), max(rms, SMALLEST), corner])
        found.append(minimize(cost, start, method="L-BFGS-B", bounds=bounds))
    best = min(found, key=lambda each: float(each.fun)).x
    noise_rms, rms, corner = (
        Interval(float(np.exp(x)), float(np.exp(x - reach)), float(np.exp(x + reach)))
        for x, reach in zip(best, _reach(best, expected, independent), strict=True)
    )
    hertz = Interval(*(x / (2.0 * np.pi) for x in (corner.value, corner.low, corner.high)))
    return Surroundings(noise_rms=noise_rms, disturbance_rms=rms, corner_hz=hertz, windows=windows)


def _reach(best: Floats, expected: Callable[[Floats], Floats], independent: float) -> Floats:
    """Half the width of each parameter's interval at 95 %, by Fisher's information of averaged periodograms."""
    step = 1e-4
    slopes = np.array(
        [(np.log(expected(best + move)) - np.log(expected(best - move))) / 2.0 for move in step * np.eye(3)]
    )
    slopes /= step
    information = independent * slopes @ slopes.T
    reach = NORMAL_95 * np.sqrt(np.maximum(np.diag(np.linalg.pinv(information)), 0.0))
    return np.asarray(np.minimum(reach, UNKNOWN))

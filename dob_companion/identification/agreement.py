"""Whether a design's model still holds: what was measured, over what the design was made for, as a gain and a delay.

G_measured(w) / G_design(w) = gain e^(-j w delay), fitted over the band by its accuracy at each frequency. What the two
numbers do not explain widens their intervals.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import t as students_t

from dob_companion.artifact import DobBlock
from dob_companion.identification.result import Complexes, Interval, Response
from dob_companion.lti.response import response as response_of

Floats = NDArray[np.float64]

LEAST_FREQUENCIES = 6
"""Below this many a response shows no gain and delay with their intervals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shift:
    """A gain and a delay at 95 %, and what they leave, as in `Agreement`."""

    gain: Interval
    delay_s: Interval
    misfit: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """One axis, at 95 %.

    gain     of the aircraft over that of the model
    delay_s  of the aircraft beyond the model's; below 0 where it is faster
    misfit   root mean square of what gain and delay leave, relative
    """

    axis: str
    gain: Interval
    delay_s: Interval
    misfit: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerance:
    """What a design bears: gain from `low` to `high` of the model's, and so much more delay, s."""

    low: float
    high: float
    delay_s: float


def agreement(axis: str, measured: Response, block: DobBlock, dt: float) -> Agreement | None:
    """None where the response has too few frequencies. A hold at another rate than the design's, dt in s, is late by
    half of its own sample; that is made up for."""
    if len(measured.frequency) < LEAST_FREQUENCIES:
        return None
    index = block.axes.index(axis)
    model = response_of(block.problem.plant, measured.frequency * dt)[:, index, index]
    model = model * np.exp(0.5j * measured.frequency * (dt - 1.0 / measured.rate_hz))
    ratio, deviation = measured.value / model, measured.deviation / np.abs(model)

    found = shift(measured.frequency, ratio, deviation)
    return Agreement(axis=axis, gain=found.gain, delay_s=found.delay_s, misfit=found.misfit)


def shift(frequency: Floats, ratio: Complexes, deviation: Floats) -> Shift:
    """By which a response is off one that it is divided by; all of shape (n,), frequency in rad/s."""

    def error(p: Floats) -> Floats:
        apart = (ratio - p[0] * np.exp(-1j * frequency * p[1] * 1e-3)) / deviation
        return np.concatenate([apart.real, apart.imag])

    start = [float(np.median(np.abs(ratio))), 0.0]
    fitted = least_squares(error, start, x_scale="jac")
    free = 2 * len(ratio) - 2
    spread = max(1.0, 2.0 * float(fitted.cost) / free * 2.0)  # each part of a complex error has half its variance
    slopes: Floats = np.asarray(fitted.jac, dtype=np.float64)
    covariance = 0.5 * spread * np.linalg.inv(slopes.T @ slopes)
    reach = float(students_t.ppf(0.975, free)) * np.sqrt(np.diag(covariance))
    gain, late = fitted.x
    left = np.abs(ratio / (gain * np.exp(-1j * frequency * late * 1e-3)) - 1.0)
    weight = deviation**-2
    return Shift(
        gain=Interval(float(gain), float(gain - reach[0]), float(gain + reach[0])),
        delay_s=Interval(*(1e-3 * float(x) for x in (late, late - reach[1], late + reach[1]))),
        misfit=float(np.sqrt(np.sum(weight * left**2) / np.sum(weight))),
    )


def tolerance(block: DobBlock, dt: float) -> Tolerance:
    """By the disk margin (half of it, so that the other half is left) and the delay margin of the certificate."""
    half = 0.5 * block.certificate.disk_margin
    return Tolerance(
        low=(2.0 - half) / (2.0 + half),
        high=(2.0 + half) / (2.0 - half),
        delay_s=0.5 * block.certificate.delay_margin_samples * dt,
    )


def verdict(found: Agreement, bears: Tolerance) -> tuple[bool | None, str]:
    """Whether the model holds, None where the intervals do not decide; and why in one line."""
    inside = bears.low <= found.gain.low and found.gain.high <= bears.high and found.delay_s.high <= bears.delay_s
    outside = found.gain.low > bears.high or found.gain.high < bears.low or found.delay_s.low > bears.delay_s
    numbers = (
        f"gain {found.gain.value:.3g} ({found.gain.low:.3g} to {found.gain.high:.3g}) of the model's, "
        f"delay {1e3 * found.delay_s.value:+.2g} ms ({1e3 * found.delay_s.low:+.2g} to {1e3 * found.delay_s.high:+.2g})"
    )
    allowed = f"allowed {bears.low:.3g} to {bears.high:.3g}, and {1e3 * bears.delay_s:.2g} ms more"
    if inside:
        return True, f"the model holds: {numbers}; {allowed}"
    if outside:
        return False, f"the model does not hold: {numbers}; {allowed}: identify and design again"
    return None, f"cannot be told yet: {numbers}; {allowed}: excite for longer (--seconds)"

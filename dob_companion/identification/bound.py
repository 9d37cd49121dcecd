"""|G_true / G - 1| at most, over frequency, jointly at 95 %: what a robust design takes.

In the band it follows from the data: what they leave of the model's misfit over half an octave to either side, plus its
uncertainty, single frequencies that differ by more than noise makes them, and what is not known of each flexible mode.
Below the band the model's parameters rule, above it nothing is known: the bound rises there, with the square of
frequency, beyond 1.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as f_distribution

from dob_companion.identification.fit import MODES, Data, Fit, Spread
from dob_companion.identification.grid import Flags
from dob_companion.identification.result import Bound, Complexes, Floats

LEAST = 0.02
ABOVE = 0.25
"""At least, just above the band."""
MOST, MOST_BELOW, BELOW_HZ = 3.0, 0.9, 2.5
"""Far above the band; below it, and below so many Hz where it was seen badly: there a rigid body has nothing to hide
but its slow pole. A bound of 1 would hold an aircraft that does not answer at all, and no loop is proved for that."""
NEAR = 0.5
"""Octaves to either side over which the misfit is averaged."""
KNOTS = 12
SHARPER, FLANK = 1.4, 1.03
"""A peak is this much higher than windows show, and wider to either side."""
MOST_PEAK = 10.0
ABOUT_A_MODE = np.array([-8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0])
"""Of the widths of a dip or a peak, where the bound has knots; between two of them lines are near enough."""
DRAWN = 200
"""Models on the edge of a joint region."""
JOINTLY = 0.05


@dataclass(frozen=True, slots=True)
class Peaks:
    """A response of fine resolution, and the averages behind it: to look for lightly damped modes."""

    data: Data
    averages: Floats


def bound(chosen: Fit, richest: Fit, spread: Spread, averages: Floats, between: Floats, peaks: Peaks) -> Bound:
    """Of the chosen model. `between`: relative standard deviation of the response from segment to segment or record to
    record, shape of the data's frequency."""
    data = chosen.data
    hertz = data.frequency / (2.0 * np.pi)
    known = _measured(chosen, averages, max(1.0, richest.chi2)) + 2.0 * between
    top = 0.5 / data.dt
    low, high = float(hertz[0]), float(hertz[-1])
    below = np.geomspace(low / 30.0, low, 9)[:-1]
    inside = np.geomspace(low, high, KNOTS)
    above = high * np.sqrt(2.0) ** np.arange(1, 9)
    above = above[above < top]
    knots = np.concatenate([[0.0], below, inside, above])
    fine = np.unique(np.concatenate([np.geomspace(low / 30.0, low, 40), hertz, inside]))
    wanted = np.interp(fine, hertz, known)
    under = fine < low
    wanted[under] = np.clip(_by_parameters(chosen, richest, spread, fine[under]), known[0], MOST_BELOW)
    values = []
    for k, knot in enumerate(knots):
        if knot > high:
            values.append(min(MOST, max(ABOVE, known[-1]) * (knot / high) ** 2))
            continue
        left, right = knots[max(0, k - 1)], knots[min(k + 1, len(knots) - 1)]
        about = (fine >= left) & (fine <= min(right, high))
        values.append(max(float(np.max(wanted[about], initial=LEAST)), float(np.interp(knot, fine, wanted))))
    at_high = len(values) - len(above) - 1
    values[at_high] = max(values[at_high], ABOVE)
    smooth = np.array(values) * 1.0005
    knots, smooth = _with_peaks(knots, smooth, chosen, peaks)
    knots, smooth = _with_modes(knots, smooth, richest, spread)
    return Bound(tuple(_rounded(knots)), tuple(_rounded(smooth)), (low, high))


def _with_peaks(knots: Floats, values: Floats, chosen: Fit, peaks: Peaks) -> tuple[Floats, Floats]:
    """The bound with what stands out of it at fine resolution, each as a trapezoid."""
    if not len(peaks.averages):
        return knots, values
    model = chosen.response(peaks.data.frequency, peaks.data.dt)
    hertz, off = peaks.data.frequency / (2.0 * np.pi), np.abs(peaks.data.value / model - 1.0)
    noise = peaks.data.deviation / np.abs(model)
    freedom = 2.0 * np.maximum(peaks.averages - 2.0, 1.0)
    single = np.sqrt(f_distribution.ppf(1.0 - JOINTLY / len(off), 2.0, freedom))
    out = (off > single * noise) & (off + noise > np.interp(hertz, knots, values))
    edges = np.flatnonzero(np.diff(np.concatenate(([False], _joined(out), [False])).astype(np.int8)))
    for a, b in edges.reshape(-1, 2):
        level = min(MOST_PEAK, float(np.max((SHARPER * off + noise)[a:b])))
        corners = np.array([hertz[a] / FLANK**2, hertz[a] / FLANK, hertz[b - 1] * FLANK, hertz[b - 1] * FLANK**2])
        union = np.unique(np.concatenate([knots, corners]))
        peak = np.interp(union, corners, [0.0, level, level, 0.0], left=0.0, right=0.0)
        values = np.maximum(np.interp(union, knots, values), peak)
        knots = union
    return knots, values


def _with_modes(knots: Floats, values: Floats, richest: Fit, spread: Spread) -> tuple[Floats, Floats]:
    """The bound with what is not known of each flexible mode: a dip or a peak a little beside where it is taken for is
    much, and only there, so that the misfit averaged over half an octave does not show it."""
    for k in range(MODES, len(richest.parameters), 4):
        own = richest.parameters[k : k + 4]
        moved = own + _edge(spread.covariance[1 + k : 5 + k, 1 + k : 5 + k])
        moved[:, 1::2] = np.maximum(moved[:, 1::2], 0.2 * own[1::2])
        hertz = np.sort(np.concatenate([w * (1.0 + damping * ABOUT_A_MODE) for w, damping in own.reshape(2, 2)]))
        hertz = hertz[hertz > 0.0] / (2.0 * np.pi)
        off = np.max(np.abs(_mode(moved, hertz) / _mode(own[None, :], hertz) - 1.0), axis=0)
        union = np.unique(np.concatenate([knots, hertz]))
        values = np.hypot(np.interp(union, knots, values), np.interp(union, hertz, off, left=0.0, right=0.0))
        knots = union
    return knots, np.minimum(values, np.maximum(MOST_PEAK, MOST))


def _mode(parameters: Floats, hertz: Floats) -> Complexes:
    """Rows of a peak's and a dip's frequency and damping."""
    s = 2j * np.pi * hertz
    peak, damping, dip, damping_dip = (column[:, None] for column in parameters.T)
    over, under = (1.0 + 2.0 * d * s / w + (s / w) ** 2 for w, d in ((dip, damping_dip), (peak, damping)))
    return np.asarray(over / under)


def _edge(covariance: Floats) -> Floats:
    """Steps to the edge of the joint region at 95 %, in all directions that there are."""
    directions = np.random.default_rng(0).standard_normal((DRAWN, len(covariance)))
    used = int(np.count_nonzero(np.diag(covariance)))
    directions *= np.sqrt(chi2.ppf(1.0 - JOINTLY, used)) / np.linalg.norm(directions, axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(directions @ (vectors * np.sqrt(np.maximum(values, 0.0))).T)


def _joined(out: Flags) -> Flags:
    """Runs with a gap of one or two between them are one."""
    joined = out.copy()
    for gap in (1, 2):
        for k in np.flatnonzero(out[: -gap - 1] & out[gap + 1 :]):
            joined[k : k + gap + 1] = True
    return joined


def _rounded(values: Floats) -> list[float]:
    return [float(f"{value:.4g}") for value in values]


def _measured(chosen: Fit, averages: Floats, scatter: float) -> Floats:
    """At each frequency of the data."""
    data: Data = chosen.data
    model = chosen.gain * data.model(chosen.parameters)
    off, noise = data.value / model - 1.0, data.deviation / np.abs(model) * np.sqrt(scatter)
    octaves = np.log2(data.frequency)
    near = np.abs(octaves[:, None] - octaves[None, :]) <= NEAR
    weight = near / noise**2
    total = weight.sum(axis=1)
    freedom = 2.0 * np.maximum(averages - 2.0, 1.0)
    regions = max(2.0, (octaves[-1] - octaves[0]) / NEAR)
    local = np.sqrt(f_distribution.ppf(1.0 - JOINTLY / regions, 2.0, freedom * near.sum(axis=1)))
    single = np.sqrt(f_distribution.ppf(1.0 - JOINTLY / len(off), 2.0, freedom))
    smooth = np.abs(np.sum(weight * off, axis=1)) / total + local / np.sqrt(total)
    smooth = np.where(data.frequency < 2.0 * np.pi * BELOW_HZ, np.minimum(smooth, MOST_BELOW), smooth)
    odd = np.where(np.abs(off) > single * noise, np.abs(off) + noise, 0.0)
    return np.asarray(np.clip(np.maximum(smooth, odd), LEAST, MOST))


def _by_parameters(chosen: Fit, richest: Fit, spread: Spread, hertz: Floats) -> Floats:
    """Largest of many models inside the joint region of the richest structure's parameters."""
    moves = _edge(spread.covariance)
    w = 2.0 * np.pi * hertz
    # Far below all lags and delays only gain and slow pole count.
    nominal = chosen.gain / (1j * w + chosen.parameters[0])
    pole = np.maximum(richest.parameters[0] + moves[:, 1:2], 0.0)
    there = richest.gain * (1.0 + moves[:, :1]) / (1j * w + pole)
    return np.asarray(np.max(np.abs(there / nominal - 1.0), axis=0))

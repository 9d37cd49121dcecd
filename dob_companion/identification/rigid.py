"""A model without its flexible modes, which its bound then has to cover.

Each mode in a plant costs a design two states and more. An observer acts well below them, and what they do up there is
|(1 + w) M - 1| <= |M - 1| + w |M|, w the bound of the model with the modes M.
"""

from dataclasses import replace

import numpy as np

from dob_companion.identification.result import AxisModel, Bound, Floats

APART = (0.0, 0.01, 0.02, 0.035, 0.05, 0.08, 0.12, 0.2, 0.35, 0.5)
"""Distances from a peak or a dip, relative, at which the bound has a knot."""
BETWEEN = 5
"""Points looked at between two knots."""
NEXT = 1.01
"""Ratio of a knot to the one before, at least: the most of what is around counts, so that fewer do."""
LOWEST_HZ = 1e-3


def rigid(model: AxisModel, rate_hz: float) -> AxisModel:
    """The same where it has no modes."""
    if not model.modes:
        return model
    bare = replace(model, modes=())
    knots = _knots(model)
    fine = np.interp(np.arange(BETWEEN * (len(knots) - 1) + 1) / BETWEEN, np.arange(len(knots)), knots)
    w = 2.0 * np.pi * np.maximum(fine, LOWEST_HZ)
    modes = model.response(w, rate_hz) / bare.response(w, rate_hz)
    needed = np.abs(modes - 1.0) + np.abs(modes) * model.bound.at(fine)
    # A line between two knots is above what lies between them when each is the most of what is around it.
    values = [float(np.max(needed[max(0, BETWEEN * (k - 1)) : BETWEEN * (k + 1) + 1])) for k in range(len(knots))]
    rounded = Bound(
        tuple(map(float, knots)), tuple(float(f"{1.0005 * value:.4g}") for value in values), model.bound.band_hz
    )
    return replace(bare, bound=rounded)


def _knots(model: AxisModel) -> Floats:
    own = list(model.bound.frequency_hz)
    centres = [hz.value for mode in model.modes for hz in (mode.frequency_hz, mode.zero_frequency_hz)]
    near = [centre * (1.0 + sign * apart) for centre in centres for apart in APART for sign in (-1.0, 1.0)]
    within = sorted({float(f"{hz:.4g}") for hz in (*own, *near) if hz <= own[-1]})
    kept = within[:1]
    for hz in within[1:]:
        if hz > NEXT * kept[-1] or hz == own[-1]:
            kept.append(hz)
    return np.array(kept)

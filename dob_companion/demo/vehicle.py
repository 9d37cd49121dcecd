"""Whether a design is for the simulated tail-sitter or for another aircraft."""

import numpy as np

from dob_companion.errors import SpecError
from dob_companion.lti.response import response
from dob_companion.synthesis import Spec
from dob_companion.synthesis.plant.models import to_state_space

RATE_HZ = 250.0

BAND_HZ = (0.5, 20.0)
"""Where the baseline loop and the observer work."""

MOST = 0.5
"""Largest relative difference of a model from the vehicle's plant in that band. A gain that is 30 % off, as scenarios
have it, is an error of the model; twice the gain is another aircraft."""


def require_rate(spec: Spec) -> None:
    """Raise SpecError, one line, for a rate that the simulated vehicle does not have."""
    if spec.rate_hz != RATE_HZ:
        raise SpecError(f"{spec.source}: design.rate_hz is {spec.rate_hz:g}; the simulated vehicle has {RATE_HZ:g} Hz")


def is_tailsitter(spec: Spec, own: Spec) -> bool:
    """Whether `spec` designs for the plant of `own`, the tail-sitter's spec, in each axis that it has."""
    known = {block.axes[0]: block.plant for block in own.blocks}
    angles = 2.0 * np.pi * np.geomspace(*BAND_HZ, 60) / RATE_HZ
    for block in spec.blocks:
        size = len(block.axes)
        found = response(to_state_space(block.plant, spec.dt, (size, size)), angles)
        for i, axis in enumerate(block.axes):
            true = response(to_state_space(known[axis], spec.dt, (1, 1)), angles)[:, 0, 0]
            wanted = np.where(np.arange(size) == i, 1.0, 0.0) * true[:, None]
            if np.max(np.abs(found[:, i, :] - wanted) / np.abs(true)[:, None]) > MOST:
                return False
    return True

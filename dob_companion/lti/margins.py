"""How far a loop is from instability."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dob_companion.lti.response import ComplexArray, spectral_radius

Array = NDArray[np.float64]

MOST_DELAY_SAMPLES = 50
"""Searches for delay margins end here; a margin of this size means "at least"."""


def delay_margin(late: Callable[[int], Array]) -> int:
    """Most whole samples of further delay that leave a loop stable; late(k) is the closed loop's A with k of them."""
    for extra in range(1, MOST_DELAY_SAMPLES + 1):
        if spectral_radius(late(extra)) >= 1.0:
            return extra - 1
    return MOST_DELAY_SAMPLES


def disk_margin(S: ComplexArray) -> float:
    """Disk margin of skew 0 of one loop, 1 / max |S - 1/2|, from its sensitivity at many angles.

    P. Seiler, A. Packard, P. Gahinet, "An introduction to disk margins", IEEE Control Systems 40(5), 2020.
    """
    return float(1.0 / np.max(np.abs(S - 0.5)))

"""Filters as state space."""

import math

import numpy as np

from dob_companion.lti.statespace import ABCD


def butterworth(dt: float, cutoff_hz: float, *, high_pass: bool = False) -> ABCD:
    """Second-order Butterworth low-pass or high-pass at `dt` s (bilinear transform, cutoff prewarped)."""
    k = math.tan(math.pi * cutoff_hz * dt)
    norm = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    a1, a2 = 2.0 * (k * k - 1.0) * norm, (1.0 - math.sqrt(2.0) * k + k * k) * norm
    b0 = norm if high_pass else k * k * norm
    b1, b2 = (-2.0 * b0 if high_pass else 2.0 * b0), b0
    return ABCD(
        np.array([[-a1, 1.0], [-a2, 0.0]]),
        np.array([[b1 - a1 * b0], [b2 - a2 * b0]]),
        np.array([[1.0, 0.0]]),
        np.array([[b0]]),
    )

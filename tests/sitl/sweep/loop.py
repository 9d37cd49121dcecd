"""An oracle: the closed rate loop as transfer functions, run by `scipy.signal.lfilter`, with no part of the vehicle."""

import numpy as np
from scipy.signal import lfilter

from sitl.airframe.linear import RateAxis
from sitl.sweep.multisine import Plan, excitation

C = 0.9002 * np.poly([0.8343, 0.9987]), np.array([1.0, -1.0, 0.0])
"""Paper, Eq. (12)."""


def closed_loop(model: RateAxis, plan: Plan, seed: int, noise: float) -> np.ndarray:
    """u_e, y_n and r of G in feedback with (12), at pitch's loop gain, and white gyro noise; shape (3, samples)."""
    r = excitation(plan, seed)
    n = noise * np.random.default_rng([seed, 1]).standard_normal(len(r))
    b, a = model.gain * np.array([0.0, 1.0, -model.zero]), np.poly([1.0, model.pole])
    c, d = C[0] * 0.14131 * 2.716 / (model.gain * (1.0 - model.zero)), C[1]
    whole = np.convolve(a, d) + np.convolve(b, c)
    u = lfilter(np.convolve(a, d), whole, r) - lfilter(np.convolve(a, c), whole, n)
    y = lfilter(np.convolve(b, d), whole, r) + lfilter(np.convolve(a, d), whole, n)
    return np.array([u, y, r])

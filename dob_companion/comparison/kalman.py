"""Kalman disturbance estimator: the steady-state filter of plant and disturbance model.

Source: B. D. O. Anderson and J. B. Moore, "Optimal Filtering" (Prentice-Hall, 1979), chapters 4 and 5 (coloured noise
by augmentation, steady state by the Riccati equation); as a disturbance observer e.g. S. Li, D. Shi, X. Lyu, J. Tang,
L. Shi, "Bias-variance trade-off in Kalman filter-based disturbance observers", arXiv:2410.05061.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.comparison.augmented import Augmented, augment
from dob_companion.comparison.flight import disturbance_pole

Array = NDArray[np.float64]


def kalman(plant: Any, delay: int, disturbance_hz: float, disturbance_sigma: float, noise_sigma: float) -> Any:
    """D(z) for a disturbance taken as first-order noise of this corner (Hz) and sigma (normalized torque).

    `noise_sigma` is that of white gyro noise in rad/s. Told the truth, it has the least mean square error of d that
    any linear observer reaches.
    """
    model = augment(plant, disturbance_pole(float(plant.dt), disturbance_hz))
    return model.observer(steady_gain(model, disturbance_sigma, noise_sigma), delay)


def steady_gain(model: Augmented, disturbance_sigma: float, noise_sigma: float) -> Array:
    """Correction gain M (n+1, 1) of the steady state, from P = A P A' - A P C' (C P C' + R)^-1 C P A' + W."""
    W = np.zeros_like(model.A)
    W[-1, -1] = disturbance_sigma**2 * (1.0 - model.a**2)
    P = linalg.solve_discrete_are(model.A.T, model.C.T, W, np.array([[noise_sigma**2]]))
    return np.asarray(P @ model.C.T / (model.C @ P @ model.C.T + noise_sigma**2))

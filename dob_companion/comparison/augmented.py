"""Plant and disturbance as one state, observed: the common body of the Kalman filter and the extended-state observer.

x+ = A x + B (u_e + d), y_n = C x + n, d+ = a d + w. With correction gain M (current estimator):

    x(k|k)   = x(k|k-1) + M (y_n(k) - C x(k|k-1))
    x(k+1|k) = A x(k|k) + B u_e(k)
    d_hat(k) = a^τ d(k|k)                          the disturbance of the sample in which the correction acts
"""

from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Augmented:
    """A (n+1, n+1), B (n+1, 1) for u_e, C (1, n+1); the disturbance is the last state, of pole `a`."""

    A: Array
    B: Array
    C: Array
    a: float
    dt: float

    def observer(self, M: Array, delay: int) -> Any:
        """D(z) of the correction gain M (n+1, 1) for a link of `delay` samples."""
        ahead = self.a**delay
        kept = np.eye(len(self.A)) - M @ self.C
        return ct.ss(
            self.A @ kept,
            np.hstack([self.A @ M, self.B]),
            ahead * kept[-1:],
            np.array([[ahead * M[-1, 0], 0.0]]),
            self.dt,
        )


def augment(plant: Any, pole: float) -> Augmented:
    """A strictly proper SISO plant with a disturbance of pole `pole` at its input; 1 is a constant."""
    n = plant.nstates
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[:n, n:], A[n, n] = plant.A, plant.B, pole
    return Augmented(A, np.vstack([plant.B, [[0.0]]]), np.hstack([plant.C, [[0.0]]]), pole, float(plant.dt))

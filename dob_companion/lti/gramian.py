"""Steady states of linear systems driven by white noise."""

import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import NotConvergedError

Array = NDArray[np.float64]

DOUBLINGS = 60
"""Enough for a spectral radius of 1 - 1e-16."""

RICCATI_STEPS = 5000
RICCATI_RELATIVE, RICCATI_ABSOLUTE = 1e-9, 1e-15


def gramian(A: Array, B: Array) -> Array:
    """P = A P A' + B B' for stable A, by doubling (Smith, SIAM J. Appl. Math. 16, 1968).

    Only sums of positive terms occur, so small and large states keep their digits side by side. Raises
    NotConvergedError when the sum does not end, as for an A that is not stable.
    """
    P, power = B @ B.T, A
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(DOUBLINGS):
            step = power @ P @ power.T
            P = P + step
            if not np.all(np.isfinite(P)):
                break
            if np.all(np.diag(step) <= 1e-17 * np.diag(P)):
                return np.asarray((P + P.T) / 2.0)
            power = power @ power
    raise NotConvergedError(f"the covariance of a system of order {len(A)} does not come to rest: is it stable?")


def predictor(A: Array, C: Array, B: Array, D: Array) -> tuple[Array, Array]:
    """Gain K and error covariance P of the steady-state one-step predictor of x+ = A x + B w, y = C x + D w.

    w is white of unit covariance; x_hat+ = A x_hat + K (y - C x_hat), P = cov(x - x_hat) before y is known. The Riccati
    difference equation iterated (Anderson and Moore, "Optimal Filtering", 1979, chapter 4): numpy only, and it comes
    to rest for the detectable pairs that a certified design has. Raises NotConvergedError when it does not.
    """
    P = np.eye(len(A))
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(RICCATI_STEPS):
            S = C @ P @ C.T + D @ D.T
            K = np.linalg.solve(S.T, (A @ P @ C.T + B @ D.T).T).T
            following = A @ P @ A.T + B @ B.T - K @ S @ K.T
            if not np.all(np.isfinite(following)):
                break
            if np.all(np.abs(following - P) <= RICCATI_ABSOLUTE + RICCATI_RELATIVE * np.abs(P)):
                return np.asarray(K, dtype=np.float64), P
            P = 0.5 * (following + following.T)
    raise NotConvergedError(f"the Kalman predictor of a system of order {len(A)} does not come to rest")

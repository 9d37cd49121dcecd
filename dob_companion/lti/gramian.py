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
    raise _never_rests(A)


def gramian_root(A: Array, B: Array) -> Array:
    """L (n, n), lower triangular, with L L' = P = A P A' + B B' for stable A, by doubling of the root itself.

    A root taken of P has lost every direction below 1e-8 of the largest; this one keeps them (S. J. Hammarling, IMA J.
    Numer. Anal. 2, 1982, on why). Raises NotConvergedError as `gramian` does.
    """
    n = len(A)
    L, power = _lower(np.hstack([B, np.zeros((n, n))])), A
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(DOUBLINGS):
            step = power @ L
            if not np.all(np.isfinite(step)):
                break
            L = _lower(np.hstack([L, step]))
            if np.all(np.max(np.abs(step), axis=1) <= 3e-9 * np.max(np.abs(L), axis=1)):
                return L
            power = power @ power
    raise _never_rests(A)


def _lower(M: Array) -> Array:
    """L, lower triangular, with L L' = M M'."""
    return np.asarray(np.linalg.qr(M.T).R.T)


def _never_rests(A: Array) -> NotConvergedError:
    return NotConvergedError(f"the covariance of a system of order {len(A)} does not come to rest: is it stable?")


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

"""The discrete a-posteriori H-infinity filter by its Riccati equation: gamma* in a bracket, and the central observer.

Source: Hassibi, Sayed, Kailath, "Indefinite-Quadratic Estimation and Control" (SIAM, 1999), chapters 4
and 5: an H-infinity filter is a Kalman filter in an indefinite (Krein) space in which z is a second,
negatively weighted measurement. A filter of level gamma exists exactly when the equation has a
stabilizing solution P >= 0 and the innovation's covariance has the right inertia in the order in which
information arrives: first N' y (usable at once), then z, then the rest of y (usable a sample later).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.errors import NotConvergedError
from dob_companion.lti.response import spectral_radius
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.estimation import EstimationProblem

Array = NDArray[np.float64]

BRACKET = 1e-6
"""Relative width to which gamma* is bisected."""


@dataclass(frozen=True, slots=True, eq=False)
class CentralFilter:
    """Gains of the central observer at level gamma; K (n, p), K_z (m, p)."""

    gamma: float
    K: Array
    K_z: Array


def central_filter(problem: EstimationProblem, gamma: float) -> CentralFilter | None:
    """The central observer with error norm below gamma, or None when no observer reaches it."""
    A, B, N = problem.A, problem.B, problem.direct
    p, m = len(problem.C), len(problem.C1)
    H = np.vstack([problem.C, problem.C1])
    D = np.vstack([problem.D21, problem.D11])
    R = D @ D.T
    R[p:, p:] -= gamma**2 * np.eye(m)
    try:
        P = linalg.solve_discrete_are(A.T, H.T, B @ B.T, R, s=B @ D.T)
    except (np.linalg.LinAlgError, ValueError):
        return None
    Re = H @ P @ H.T + R
    Ryy, Ryz, Rzz = Re[:p, :p], Re[:p, p:], Re[p:, p:]
    now = N.T @ Ryy @ N
    if np.linalg.eigvalsh(P)[0] < -1e-7 * np.linalg.norm(P, 2) or not _is_positive(now):
        return None
    K_z = np.linalg.solve(now, N.T @ Ryz).T @ N.T if N.shape[1] else np.zeros((m, p))
    if not _is_positive(-(Rzz - K_z @ Ryz)) or np.sum(np.linalg.eigvalsh(Re) > 0) != p:
        return None
    try:
        K = (A @ P @ H.T + B @ D.T) @ np.linalg.solve(Re, np.vstack([np.eye(p), K_z]))
    except np.linalg.LinAlgError:  # the level lies on the edge, to the last bit
        return None
    if spectral_radius(A - K @ problem.C) >= 1.0:
        return None
    return CentralFilter(gamma, K, K_z)


def bracket_gamma_star(problem: EstimationProblem, guess: float) -> tuple[float, float]:
    """(infeasible, feasible) levels around gamma*, BRACKET apart; `guess` only saves time.

    The feasible end is measured: its central observer has a norm below it. Where rounding lets the algebra
    call a level feasible that is not, the search is repeated with every feasible level measured.

    Raises ArithmeticError when no feasible level is found below 1e9 times the guess.
    """
    low, high = _search(problem, guess, measured=False)
    if not _is_reached(problem, high):
        low, high = _search(problem, high, measured=True)
    return low, high


def _search(problem: EstimationProblem, guess: float, *, measured: bool) -> tuple[float, float]:
    def feasible(gamma: float) -> bool:
        return _is_reached(problem, gamma) if measured else central_filter(problem, gamma) is not None

    low, high, step = guess, guess, 1e-5
    while not feasible(high):
        low, high, step = high, high * (1.0 + step), min(8.0 * step, 10.0)
        if high > 1e9 * guess:
            raise ArithmeticError(f"the Riccati equation has no solution at any level up to {high:.3g}")
    if low == high:
        step = 1e-5
        while (low := low / (1.0 + step)) > 1e-12 * guess and feasible(low):
            high, step = low, min(8.0 * step, 10.0)
    while high > low * (1.0 + BRACKET):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if feasible(middle) else (middle, high)
    return low, high


def _is_reached(problem: EstimationProblem, gamma: float) -> bool:
    found = central_filter(problem, gamma)
    try:
        return found is not None and hinf_norm(problem.error_system(found.K, found.K_z))[0] <= gamma * (1.0 + BRACKET)
    except NotConvergedError:
        return False


def _is_positive(M: Array) -> bool:
    return M.size == 0 or bool(np.linalg.eigvalsh((M + M.T) / 2.0)[0] > 0.0)

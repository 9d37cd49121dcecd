"""A lower bound on what any observer reaches, from any multipliers of the linear matrix inequality.

A solver's dual value is a bound only as far as its equality constraints hold, and a solver that stalls leaves them
open. What follows needs none of them. Let J be any joint covariance of (e, w), estimation error and what drives it,
X its part of e, and P the error covariance of the Kalman filter (w white, of unit variance). Then for every observer

    gamma^2  >=  tr cov(z | N' y) / (tr cov(w) + tr(P^-1 [X - cov(e+ | y)]+))

with e+ = A e + B w, y = C e + D21 w, z = C1 e + D11 w, cov(a | b) what b does not tell of a by linear regression, [.]+
the positive part, N' y what the observer may use at once. Proof: pair the inequality F(S, K, K_z, gamma) >= 0 of
`lmi.py` with the covariance of (-e+~, e, w, -a z~), ~ for what y and N' y do not tell. K and K_z drop out, and

    tr(S (X - cov(e+ | y))) + gamma (tr cov(w) + a^2 tr cov(z | N' y))  >=  2 a tr cov(z | N' y)

for every a. S <= gamma P^-1, because a storage function is at most gamma times the least energy that drives the error
there, and no observer's error has a smaller covariance than the Kalman filter's. The best a gives the bound. With the
optimal J nothing is lost; a poor J makes the bound weak, not wrong.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.synthesis.plant.estimation import EstimationProblem

Array = NDArray[np.float64]

KALMAN_STEPS = 200
"""Of the Kalman filter's Riccati equation from P = 0, at most. P only grows on the way: any of them gives a bound."""

KNOWN = 1e-10
"""Share of P's largest eigenvalue below which a direction may be one that the filter knows without error."""

SMALLEST = 1e-16
"""Share of P's largest eigenvalue at which the others are cut off: what is less is rounding."""


def lower_bound(problem: EstimationProblem, J: Array) -> float:
    """The bound above for J (n + q, n + q), its negative part removed; 0.0 where there is none.

    What the filter knows without error has no room in J: what rounding leaves of it costs P^-1. The bound holds for any
    J, so that J is tried without it as well.
    """
    n = len(problem.A)
    P = _kalman_from_rest(np.hstack([problem.A, problem.B]), np.hstack([problem.C, problem.D21]))
    sizes, axes = np.linalg.eigh((P + P.T) / 2.0)
    J = _positive(J)
    bounds = [_bound(problem, J, sizes, axes)]
    uncertain = axes[:, sizes > KNOWN * sizes[-1]]
    if uncertain.shape[1] < n:
        kept = linalg.block_diag(uncertain @ uncertain.T, np.eye(len(J) - n))
        bounds.append(_bound(problem, kept @ J @ kept, sizes, axes))
    return max(bounds)


def _bound(problem: EstimationProblem, J: Array, sizes: Array, axes: Array) -> float:
    """For P of these eigenvalues and eigenvectors."""
    n, free = len(problem.A), problem.direct.T
    following, told, wanted = (
        np.hstack(parts) for parts in ((problem.A, problem.B), (problem.C, problem.D21), (problem.C1, problem.D11))
    )
    unforeseen = _positive(J[:n, :n] - _unexplained(following, told, J))
    price = np.sum((axes.T @ unforeseen @ axes).diagonal() / np.maximum(sizes, SMALLEST * sizes[-1]))
    missed, spent = np.trace(_unexplained(wanted, free @ told, J)), np.trace(J[n:, n:]) + price
    return float(np.sqrt(missed / spent)) if spent > 0.0 and missed > 0.0 else 0.0


def _kalman_from_rest(following: Array, told: Array) -> Array:
    """Error covariance of the Kalman filter some steps after the error was zero, hence no larger than in the end."""
    n, drives = len(following), np.eye(following.shape[1] - len(following))
    P = np.zeros((n, n))
    for _ in range(KALMAN_STEPS):
        before, P = P, _unexplained(following, told, linalg.block_diag(P, drives))
        if np.all(np.diag(P) <= 1.01 * np.diag(before)):
            break
    return P


def _unexplained(wanted: Array, told: Array, J: Array) -> Array:
    """cov(wanted v | told v) for v of covariance J."""
    if not len(told):
        return np.asarray(wanted @ J @ wanted.T)
    share = np.linalg.lstsq(told @ J @ told.T, told @ J @ wanted.T, rcond=1e-14)[0]
    rest = wanted - share.T @ told
    return np.asarray(rest @ J @ rest.T)


def _positive(M: Array) -> Array:
    sizes, axes = np.linalg.eigh((M + M.T) / 2.0)
    return np.asarray((axes * np.maximum(sizes, 0.0)) @ axes.T)

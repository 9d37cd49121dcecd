"""Coordinates in which the estimation problem is well conditioned.

Units may differ by 1e6 between channels and integrators stand beside fast modes. In the coordinates in
which the error of the Kalman filter of the same problem is white, and so is its innovation, and with z in
units of that filter's own H-infinity norm, none of that is left: the LMI and the Riccati equation work on
numbers of order one. The observer does not depend on the coordinates.

One change of coordinates reaches no further than FLOORS. Where the filter's error is smaller than that in some
direction (companion forms, chains of lags) it is made white in several, each small enough to lose no digits.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.lti.gramian import gramian_root
from dob_companion.lti.response import spectral_radius
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.estimation import EstimationProblem

Array = NDArray[np.float64]

FLOORS = (1e-4, 1e-6, 1e-2)
"""Error directions below this share of the largest are treated as if they were of that size; in order of trial."""

PASSES = 6
"""Changes of coordinates at most."""

ADDED = 1e-12
"""Noise added to the measurements, as a share of all of theirs in power, so that the filter exists."""

UNEVEN = 100.0
"""Entry of A at most after scaling by the first samples; in good coordinates they are of the order of 1."""

STEADY, FORGETS = 0.99999, 1.02
"""Spectral radius from which on there is no long run, and how much faster than it the window forgets."""

WHITE = 0.9
"""Least error direction as a share of the largest, from which on the error counts as white."""


@dataclass(frozen=True, slots=True, eq=False)
class WhiteProblem:
    """`problem` in white coordinates: xi = T xi', y' = measure y_n, z = level z'; gamma' = gamma / level."""

    problem: EstimationProblem
    T: Array
    measure: Array
    level: float

    def gains(self, K: Array, K_z: Array) -> tuple[Array, Array]:
        """Gains found in white coordinates, for the original problem."""
        return self.T @ K @ self.measure, self.level * K_z @ self.measure


def whitened(problem: EstimationProblem, floor: float = FLOORS[0]) -> WhiteProblem:
    """Change coordinates. Raises LinAlgError when the Kalman filter does not exist."""
    first = rough_scaling(problem)
    rough = problem.transformed(*first)
    step, K, K_z, white = _kalman(rough, floor)
    level = hinf_norm(rough.error_system(K, K_z))[0]
    if not 0.0 < level < np.inf:
        raise np.linalg.LinAlgError(f"the Kalman filter of this problem has error norm {level}")
    steps = [step] if white else _steps(rough, step, floor)
    T, measure = first
    for change, unit in steps:
        rough, T, measure = rough.transformed(change, unit), T @ change, unit @ measure
    return WhiteProblem(replace(rough, C1=rough.C1 / level, D11=rough.D11 / level), T, measure, level)


def _steps(problem: EstimationProblem, first: tuple[Array, Array], floor: float) -> list[tuple[Array, Array]]:
    """Changes of coordinates, the first one given, after which all is white; only the first where that cannot be.

    It cannot where the filter knows a direction without any error, as without noise or with two gyros for one rate: its
    error is then what ADDED makes of it, and would be made as large as all else. With less added it would be less.
    """
    steps = [first]
    for _ in range(PASSES - 1):
        problem = problem.transformed(*steps[-1])
        try:
            step, _, _, white = _kalman(problem, floor)
            steps.append(step)
            if white:
                return steps if _kalman(problem.transformed(*step), WHITE, 0.01 * ADDED)[3] else [first]
        except (np.linalg.LinAlgError, ValueError):
            break
    return [first]


def rough_scaling(problem: EstimationProblem) -> tuple[Array, Array]:
    """Diagonal scaling by the size that w = 1 gives states and measurements within a few samples, from rest.

    Resonances take longer to show how large states become: where entries of A would exceed UNEVEN, their size in the
    long run counts (with modes on the unit circle: seen through a window that forgets).
    """
    A, B = problem.A, problem.B
    size = np.zeros(len(A))
    for k in range(3 + len(A)):
        if k >= 3 and np.all(size > 0.0):
            break
        size = np.linalg.norm(np.hstack([A * size, B]), axis=1)
    size = _or_one(size)
    if np.max(np.abs(A * size / size[:, None]), initial=0.0) > UNEVEN:
        radius = spectral_radius(A)
        size = _or_one(np.linalg.norm(gramian_root(A if radius < STEADY else A / (FORGETS * radius), B), axis=1))
    seen = _or_one(np.linalg.norm(np.hstack([problem.C * size, problem.D21]), axis=1))
    return np.diag(size), np.diag(1.0 / seen)


def _or_one(sizes: Array) -> Array:
    return np.where(sizes > 0.0, sizes, 1.0)


def _kalman(
    problem: EstimationProblem, floor: float, added: float = ADDED
) -> tuple[tuple[Array, Array], Array, Array, bool]:
    """Whitening transformations, the filter's gains, and whether no direction lies below the floor."""
    A, B, C, D = problem.A, problem.B, problem.C, problem.D21
    R = D @ D.T
    R = R + added * np.trace(R) * np.eye(len(R)) + 1e-24 * np.eye(len(R))
    P = linalg.solve_discrete_are(A.T, C.T, B @ B.T, R, s=B @ D.T)
    w, V = np.linalg.eigh((P + P.T) / 2.0)
    T = V * np.sqrt(np.maximum(w, floor**2 * w[-1]))
    innovation = C @ P @ C.T + R
    K = np.linalg.solve(innovation, C @ P @ A.T + D @ B.T).T
    N = problem.direct
    K_z = np.linalg.solve(N.T @ innovation @ N, N.T @ (C @ P @ problem.C1.T + D @ problem.D11.T)).T @ N.T
    unit = np.asarray(np.linalg.inv(np.linalg.cholesky(innovation)))
    return (T, unit), K, K_z, bool(w[0] >= floor**2 * w[-1])

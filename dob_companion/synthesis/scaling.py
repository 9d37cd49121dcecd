"""Coordinates in which the estimation problem is well conditioned.

Units may differ by 1e6 between channels and integrators stand beside fast modes. In the coordinates in
which the error of the Kalman filter of the same problem is white, and so is its innovation, none of that
is left: the LMI and the Riccati equation then work on numbers of order one. The observer itself does not
depend on the coordinates.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.synthesis.plant import EstimationProblem

Array = NDArray[np.float64]

FLOOR = 1e-3
"""Error directions smaller than this share of the largest are treated as if they were of that size."""


def whitened(problem: EstimationProblem) -> tuple[EstimationProblem, Array, Array]:
    """The problem in white coordinates, and the (T, measure) that lead there: xi = T xi', y' = measure y_n.

    Raises LinAlgError when the Kalman filter does not exist.
    """
    first = _rough(problem)
    second = _kalman(problem.transformed(*first))
    T, measure = first[0] @ second[0], second[1] @ first[1]
    return problem.transformed(T, measure), T, measure


def _rough(problem: EstimationProblem) -> tuple[Array, Array]:
    """Diagonal scaling by the size that w = 1 gives states and measurements within a few samples."""
    A, B = problem.A, problem.B
    size = np.ones(len(A))
    for _ in range(3):
        size = _or_one(np.linalg.norm(np.hstack([A * size, B]), axis=1))
    seen = _or_one(np.linalg.norm(np.hstack([problem.C * size, problem.D21]), axis=1))
    return np.diag(size), np.diag(1.0 / seen)


def _or_one(sizes: Array) -> Array:
    return np.where(sizes > 0.0, sizes, 1.0)


def _kalman(problem: EstimationProblem) -> tuple[Array, Array]:
    A, B, C, D = problem.A, problem.B, problem.C, problem.D21
    R = D @ D.T
    R = R + 1e-12 * np.trace(R) * np.eye(len(R)) + 1e-24 * np.eye(len(R))
    P = linalg.solve_discrete_are(A.T, C.T, B @ B.T, R, s=B @ D.T)
    w, V = np.linalg.eigh((P + P.T) / 2.0)
    T = V * np.sqrt(np.maximum(w, FLOOR**2 * w[-1]))
    return T, np.asarray(np.linalg.inv(np.linalg.cholesky(C @ P @ C.T + R)))

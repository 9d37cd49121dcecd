"""The observer problem as a linear matrix inequality: the method of record, as in the paper (its eq. 9, via [16]).

The error of the observer with gains (K, K_z) obeys e+ = (A - K C) e + (B - K D21) w and
z - d_hat = (C1 - K_z C) e + (D11 - K_z D21) w. With Y = S K the bounded-real lemma is linear in
(S, Y, K_z, gamma) and, unlike Riccati equations, needs no assumption on D21 or on zeros on the unit circle.
"""

import warnings
from dataclasses import dataclass
from typing import Any

import cvxpy
import numpy as np
from numpy.typing import NDArray

from dob_companion.synthesis.plant.estimation import EstimationProblem
from dob_companion.synthesis.solve.dual import lower_bound

Array = NDArray[np.float64]

cp: Any = cvxpy  # its own annotations are partial


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LmiSolution:
    """What the solver returned; nothing here is believed until measured.

    gamma is the level it claims, dual_bound what its dual variable proves from below however inaccurate it is
    (`dual.lower_bound`), 0 for nothing.
    """

    status: str
    gamma: float
    dual_bound: float
    K: Array
    K_z: Array
    solve_time: float


def solve_lmi(problem: EstimationProblem) -> LmiSolution | None:
    """Minimize gamma over observers; None when the solver gives no usable numbers."""
    A, B, C, N = problem.A, problem.B, problem.C, problem.direct
    n, p, m, q = len(A), len(C), len(problem.C1), B.shape[1]
    S = cp.Variable((n, n), symmetric=True)
    Y = cp.Variable((n, p))
    gamma = cp.Variable()
    K_z = cp.Variable((m, N.shape[1])) @ N.T if N.shape[1] else np.zeros((m, p))
    a, b = S @ A - Y @ C, S @ B - Y @ problem.D21
    c, d = problem.C1 - K_z @ C, problem.D11 - K_z @ problem.D21
    lemma = cp.bmat(
        [
            [S, a, b, np.zeros((n, m))],
            [a.T, S, np.zeros((n, q)), c.T],
            [b.T, np.zeros((q, n)), gamma * np.eye(q), d.T],
            [np.zeros((m, n)), c, d, gamma * np.eye(m)],
        ]
    )
    inequality = lemma >> 0
    task = cp.Problem(cp.Minimize(gamma), [inequality])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # an inaccurate status is judged by measurement, not by a warning
            # One dense cone is more accurate than the decomposition of what sparsity decoupled axes leave.
            task.solve(solver=cp.CLARABEL, chordal_decomposition_enable=False)
    except (cp.error.SolverError, ValueError, ArithmeticError):
        return None
    if S.value is None or gamma.value is None or inequality.dual_value is None or not gamma.value > 0.0:
        return None
    try:
        K = np.linalg.solve(S.value, Y.value)
    except np.linalg.LinAlgError:
        return None
    gains = K_z if isinstance(K_z, np.ndarray) else np.asarray(K_z.value)
    bound = lower_bound(problem, np.asarray(inequality.dual_value)[n : 2 * n + q, n : 2 * n + q])
    return LmiSolution(
        status=task.status,
        gamma=float(gamma.value),
        dual_bound=bound,
        K=K,
        K_z=gains,
        solve_time=float(task.solver_stats.solve_time or 0.0),
    )

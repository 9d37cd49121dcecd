"""Plant modes on the unit circle that no disturbance moves: the disturbance weight has a zero there.

The classic case is an integrating plant under a W_d with a zero at z = 1 ("there is no steady disturbance"). With
G = M^-1 N and d_hat = F (M y_n - N u_e) the problem is to minimize || [W_d, 0] - z^-tau F [N W_d, M W_n] || over stable
F, and at the mode z0 both N W_d and M W_n vanish. Their common factor z - z0 can be cancelled:

* gamma_star is that of the problem without the mode: no observer does better, as z - z0 times its F is allowed there.
* It is approached but not reached: the best F of the problem without the mode gains a pole at z0, which must move
  inside, to (1 - eps) z0. Within eps of z0 that changes an error which W_d(z0) = 0 keeps far below gamma_star anyway.

So the mode is left out to find gamma_star, and stirred by a little white noise to find observers: the more noise the
farther inside is the slow pole, and the first observer that keeps to the back-off is taken.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.lti.response import response
from dob_companion.synthesis.norms.hinf import angle_grid
from dob_companion.synthesis.plant.estimation import EstimationProblem
from dob_companion.synthesis.solve.scaling import rough_scaling

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

ON_CIRCLE = 1e-7
"""Distance from the unit circle below which a mode counts as undamped, and from z = 1 and -1 as being there."""

AT_REST = 1e-7
"""Share of all else by which w may move a mode that counts as being at rest; gamma_star is as accurate as that."""

STIRS = tuple(float(share) for share in np.geomspace(0.3, 1e-6, 12))
"""White noise beside the disturbance, as a share of the weight's largest gain; in order of trial."""


@dataclass(frozen=True, slots=True, eq=False)
class Resting:
    """A problem with modes at rest: `without` them gamma_star is the same; `stir` (n + p, m) is noise at the input."""

    problem: EstimationProblem
    without: EstimationProblem
    stir: Array

    def stirred(self) -> Iterator[EstimationProblem]:
        """The problem with less and less noise that moves its modes; an observer of it is one of the problem."""
        n, blind = len(self.problem.A), np.zeros((len(self.problem.D11), self.stir.shape[1]))
        for share in STIRS:
            yield replace(
                self.problem,
                B=np.hstack([self.problem.B, share * self.stir[:n]]),
                D21=np.hstack([self.problem.D21, share * self.stir[n:]]),
                D11=np.hstack([self.problem.D11, blind]),
            )


def resting(problem: EstimationProblem, W_d: Any) -> Resting | None:
    """What is at rest in a problem posed with the disturbance weight W_d; None when everything undamped is moved."""
    without = problem.transformed(*rough_scaling(problem))
    while (unmoved := _unmoved(without)) is not None:
        without = _projected(without, linalg.null_space(unmoved))
    if len(without.A) == len(problem.A):
        return None
    peaks = np.max(np.linalg.norm(response(W_d, angle_grid(W_d.A)), axis=2), axis=0)
    peaks = np.where(peaks > 0.0, peaks, np.max(peaks))
    return Resting(problem, without, np.vstack([problem.B_u, problem.D_u]) * peaks)


def _unmoved(problem: EstimationProblem) -> Array | None:
    """Rows v with v A = z0 v and v B = 0 for one z0 on the unit circle (real and imaginary parts), or None."""
    poles = np.linalg.eigvals(problem.A) if len(problem.A) else np.zeros(0)
    for pole in poles[np.abs(np.abs(poles) - 1.0) <= ON_CIRCLE]:
        z0 = np.sign(pole.real) if abs(pole.imag) <= ON_CIRCLE else pole / abs(pole)
        U, sizes, _ = np.linalg.svd(np.hstack([problem.A - z0 * np.eye(len(problem.A)), problem.B]))
        rows = U[:, sizes < AT_REST * sizes[0]].conj().T
        if len(rows):
            return np.vstack([rows.real, rows.imag]) if np.iscomplexobj(rows) else rows
    return None


def _projected(problem: EstimationProblem, K: Array) -> EstimationProblem:
    """The problem on the range of K (n, k), whose complement is at rest."""
    return replace(
        problem,
        A=K.T @ problem.A @ K,
        B_u=K.T @ problem.B_u,
        B=K.T @ problem.B,
        C=problem.C @ K,
        C1=problem.C1 @ K,
    )

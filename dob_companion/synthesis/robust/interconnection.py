"""The loop as an uncertain plant sees it, and what a disk of factors at the plant's input can make of it.

::

               q ◄── delta = phi - 1 ◄── v        v = u_e + d, what the actuators and the wind do together
               │                         ▲
               └──► M(z), the loop ──────┘
    w = (w_d, w_n) ──►          ──► e = d - z^-tau d_hat

The observer believes in the model and is told u_e; the factor phi acts between v and the plant. With delta in a
disk diag(c_i + r_i Delta_i), |Delta_i| <= 1, the loop is shifted to its centre, N = M closed by c, and then

    beta  = min over diagonal D of || D N11 r D^-1 ||         (mu of the disk is at most beta)
    gamma = || N22 || + || N21 r D^-1 || || D N12 || / (1 - beta)

bound stability and the gain w -> e for every member. For one input the second line is replaced by the image of
the disk under x = r Delta / (1 - N11 r Delta), again a disk, which is exact. D is Perron's scaling of |N11 r|
(Safonov, IEE Proc. D 129, 1982): any D proves, a better one proves more.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.lti.response import largest, response
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.plant.problem import Problem

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PERRON_STEPS = 20


@dataclass(frozen=True, slots=True, eq=False)
class Interconnection:
    """M over N angles: q -> v (N, m, m), w -> v (N, m, k), q -> e (N, m, m), w -> e (N, m, k); M11 one angle on."""

    angles: Array
    dt: float
    M11: ComplexArray
    M12: ComplexArray
    M21: ComplexArray
    M22: ComplexArray
    next_angles: Array
    M11_next: ComplexArray

    def at(self, index: NDArray[np.intp]) -> "Interconnection":
        """The same at some of the angles only."""
        M11, M12, M21, M22, M11_next = (part[index] for part in (self.M11, self.M12, self.M21, self.M22, self.M11_next))
        return Interconnection(self.angles[index], self.dt, M11, M12, M21, M22, self.next_angles[index], M11_next)

    def closed(self, factors: ComplexArray) -> ComplexArray:
        """w -> e with the factors phi (N, m) in place."""
        return self._shifted(factors - 1.0)[3]

    def seen_by(self, factors: ComplexArray) -> ComplexArray:
        """q -> v with the factors phi (N, m) in place, for a further perturbation q of theirs."""
        return self._shifted(factors - 1.0)[0]

    def bounds(self, centres: ComplexArray, radii: Array) -> tuple[Array, Array]:
        """beta and gamma (inf where beta >= 1) over frequency, for phi in disks (N, m)."""
        radii = np.where(np.isfinite(radii), radii, 1e9)  # an unbounded disk proves nothing and must not raise
        N11, N12, N21, N22 = self._shifted(centres - 1.0)
        return (_single if radii.shape[1] == 1 else _several)(N11, N12, N21, N22, radii)

    def crossing(self, centres: ComplexArray, radii: Array, following: ComplexArray) -> Array:
        """Below 1 where no phi in the disks puts a pole on the unit circle between this angle and the next.

        beta plus || D (I - M11 c)^-1 (change of M11 c to the next angle) D^-1 ||: within a step the loop's curve stays
        within its chord's length. `following` are the centres one angle on.
        """
        radii, unit = np.where(np.isfinite(radii), radii, 1e9), np.eye(radii.shape[1])
        here = self.M11 * (centres - 1.0)[:, None, :]
        closed = np.linalg.inv(unit - here)
        N, E = closed @ self.M11 * radii[:, None, :], closed @ (self.M11_next * (following - 1.0)[:, None, :] - here)
        if radii.shape[1] == 1:
            return np.asarray(np.abs(N[:, 0, 0]) + np.abs(E[:, 0, 0]))
        scale = _perron(np.abs(N) + np.abs(E))
        ratio = scale[:, :, None] / scale[:, None, :]
        return np.asarray(largest(N * ratio) + largest(E * ratio))

    def _shifted(self, delta: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        m, column = delta.shape[1], delta[:, :, None]
        closed = np.linalg.inv(np.eye(m) - self.M11 * delta[:, None, :])
        N11, N12 = closed @ self.M11, closed @ self.M12
        return N11, N12, self.M21 @ (np.eye(m) + column * N11), self.M22 + self.M21 @ (column * N12)


def interconnect(problem: Problem, observer: Any, angles: Array) -> Interconnection:
    """M of the loop with the observer, weights of the problem included."""
    loop = close_loop(problem.plant, problem.controller, observer, problem.delays)
    weights = response(stack([problem.disturbance_weight, problem.noise_weight]), angles)
    unit = np.eye(loop.m)
    answer, error = response(loop.part("u_e", "d", "n"), angles), response(loop.part("error", "d", "n"), angles)
    M11, M21 = answer[:, :, : loop.m].copy(), error[:, :, : loop.m] - unit  # q comes in where d does, but is not d
    answer[:, :, : loop.m] += unit
    parts = M11, answer @ weights, M21, error @ weights
    on = np.minimum(np.arange(len(angles)) + 1, len(angles) - 1)
    return Interconnection(angles, problem.dt, *parts, angles[on], M11[on])


def _single(
    N11: ComplexArray, N12: ComplexArray, N21: ComplexArray, N22: ComplexArray, r: Array
) -> tuple[Array, Array]:
    N, r = N11[:, 0, 0], r[:, 0]
    beta = np.abs(N) * r
    room = np.where(beta < 1.0, 1.0 - beta**2, 1.0)
    middle = N22 + (np.conj(N) * r**2 / room)[:, None, None] * (N21 @ N12)
    gamma = np.linalg.norm(middle, axis=(1, 2)) + r / room * np.abs(N21[:, 0, 0]) * np.linalg.norm(N12, axis=(1, 2))
    return beta, np.where(beta < 1.0, gamma, np.inf)


def _several(
    N11: ComplexArray, N12: ComplexArray, N21: ComplexArray, N22: ComplexArray, r: Array
) -> tuple[Array, Array]:
    X = N11 * r[:, None, :]
    scale = _perron(np.abs(X))
    beta = largest(X * scale[:, :, None] / scale[:, None, :])
    room = np.where(beta < 1.0, 1.0 - beta, 1.0)
    outer = largest(N21 * (r / scale)[:, None, :]) * largest(scale[:, :, None] * N12)
    return beta, np.where(beta < 1.0, largest(N22) + outer / room, np.inf)


def _perron(P: Array) -> Array:
    """sqrt(left / right Perron vector) of nonnegative matrices (N, m, m), kept positive."""
    P = P + 1e-6 * np.max(P, axis=(1, 2), keepdims=True) + 1e-300
    left, right = np.ones(P.shape[:2]), np.ones(P.shape[:2])
    for _ in range(PERRON_STEPS):
        left, right = np.einsum("nij,ni->nj", P, left), np.einsum("nij,nj->ni", P, right)
        left, right = (v / np.sum(v, axis=1, keepdims=True) for v in (left, right))
    return np.asarray(np.sqrt(left / right))

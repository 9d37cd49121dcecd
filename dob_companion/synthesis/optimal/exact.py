"""The optimal observer of weights that have one in closed form, to the last digits.

A solver comes within some back-off of gamma*, and its observer has the states of plant, weights and link. What is left
after reduction depends on rounding, which for a plant of many sharp resonances spoils it. But weights W_n = c and
W_d = q z^τ / t, as `realization.weights` writes them, have an optimum D = b [m, -n] / a of order deg t - τ with

    z^τ a = t + b n              T_f has its zeros where W_d has its poles
    |z^τ a|^2 = |q|^2 + c^2 |b m|^2         the error has the same size, γ* = 1, at every frequency

Few unknowns, b alone: begun from the solver's observer, in which b is linear by the first equation, and ended by
Newton's method on the second. Nothing of this is taken on trust: what comes out is certified as any other observer.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.errors import UnsolvableError
from dob_companion.lti.response import response, spectral_radius
from dob_companion.synthesis.optimal.problem import Axis, grid
from dob_companion.synthesis.optimal.realization import realized_of
from dob_companion.synthesis.plant.problem import Problem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

STEPS, STEADY = 30, 1e-13
"""Of Newton's method at most, and the share of b below which a step ends it."""

FREE = 1e-10
"""Share of the largest singular value below which the link says nothing of a direction of b."""


def exact_optimum(problem: Problem, near: Any, gamma_star: float) -> Any | None:
    """The optimal observer of one axis, from one near it; None where the weights have none of this form."""
    W_d, W_n = problem.disturbance_weight, problem.noise_weight
    if len(problem.delays) > 1 or W_n.nstates or W_d.D.shape != (1, 1) or not W_d.D[0, 0] or not W_n.D[0, 0]:
        return None
    try:
        axis = Axis.of(problem.plant, problem.controller, problem.delays[0], 0.0)
    except UnsolvableError:
        return None
    order = W_d.nstates - axis.delay
    if order < axis.order or spectral_radius(near.A) >= 1.0:
        return None
    form = _Form(axis, W_d, float(W_n.D[0, 0]), gamma_star, order)
    b = form.solved(form.begun(near))
    roots = np.roots(np.polyadd(form.t, np.convolve(b, axis.n))[: order + 1])
    if not np.all(np.isfinite(b)) or np.max(np.abs(roots)) >= 1.0:
        return None
    return realized_of(axis, _sections(np.asarray(roots, np.complex128)), b)


class _Form:
    """t, q and c of the weights on a grid of angles, and b in the coordinates that the link leaves free."""

    def __init__(self, axis: Axis, W_d: Any, c: float, gamma_star: float, order: int) -> None:
        poles = np.linalg.eigvals(W_d.A)
        zeros = np.linalg.eigvals(W_d.A - W_d.B @ W_d.C / W_d.D[0, 0])
        self.axis, self.c, self.on = axis, c / gamma_star, grid()
        self.t = np.atleast_1d(np.real(np.poly(poles)))
        z = np.exp(1j * self.on)
        self._z, self._late = z, z**axis.delay
        self._t = _product(z, poles)
        self._q = np.abs(W_d.D[0, 0] / gamma_star * _product(z, zeros))
        self._m, self._n = _product(z, np.asarray(np.roots(axis.m), np.complex128)), np.polyval(axis.n, z)
        powers = z[:, None] ** np.arange(order - axis.order, -1, -1)
        # The last coefficients of t + b n vanish, as many as the link has samples.
        last = linalg.convolution_matrix(axis.n, powers.shape[1])[powers.shape[1] + len(axis.n) - 1 - axis.delay :]
        self._fixed, self._free = _affine(last, -self.t[len(self.t) - axis.delay :])
        self._powers = powers

    def begun(self, near: Any) -> Array:
        """The free numbers of the b that is nearest to an observer's."""
        heard = response(near, self.on)[:, 0, 0]
        slope = (self._m * self._late - heard * self._n)[:, None] * self._powers / self._q[:, None]
        rest = heard * self._t / self._q - slope @ self._fixed
        return np.asarray(np.linalg.lstsq(_split(slope @ self._free), _split(rest), rcond=None)[0])

    def solved(self, y: Array) -> Array:
        """b, by Newton's method on the size of the error at every angle."""
        for _ in range(STEPS):
            b = self._powers @ (self._fixed + self._free @ y)
            a = self._t + b * self._n
            size = (np.abs(a) ** 2 - np.abs(self.c * b * self._m) ** 2) / self._q**2 - 1.0
            both = 2.0 * (np.conj(a) * self._n - self.c**2 * np.conj(b) * np.abs(self._m) ** 2) / self._q**2
            step = np.linalg.lstsq(np.real(both[:, None] * (self._powers @ self._free)), -size, rcond=None)[0]
            y = y + step
            if np.linalg.norm(step) <= STEADY * np.linalg.norm(y):
                break
        return np.asarray(self._fixed + self._free @ y)


def _affine(M: Array, right: Array) -> tuple[Array, Array]:
    """x0 and an orthonormal basis of all x0 + basis y with M x = right."""
    if not len(M):
        return np.zeros(M.shape[1]), np.eye(M.shape[1])
    U, sizes, Vt = np.linalg.svd(M)
    rank = int(np.sum(sizes > FREE * sizes[0])) if sizes[0] > 0.0 else 0
    return Vt[:rank].T @ (U[:, :rank].T @ right / sizes[:rank]), Vt[rank:].T


def _product(z: Complex, roots: Complex) -> Complex:
    return np.asarray(np.prod(z[:, None] - roots, axis=1), np.complex128)


def _sections(roots: Complex) -> list[Array]:
    """Monic polynomials of degree 2, the last one of degree 1 for an odd count."""
    real = sorted(float(root.real) for root in roots if root.imag == 0.0)
    parts = [np.real(np.poly([root, root.conjugate()])) for root in roots if root.imag > 0.0]
    parts += [np.real(np.poly(pair)) for pair in zip(real[0::2], real[1::2], strict=False)]
    return [*parts, np.array([1.0, -real[-1]])] if len(real) % 2 else parts


def _split(values: Complex) -> Array:
    return np.asarray(np.concatenate([values.real, values.imag]))

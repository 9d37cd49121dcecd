"""The structured singular value's upper bound over diagonal scalings, min over D of || D M D^-1 ||, for many matrices.

It is mu itself for up to three scalar blocks (Packard and Doyle, Automatica 29(1), 1993). log || e^X M e^-X || is
convex in the real diagonal X, and so is the barrier -log det(1 - e^-s N* N), N = e^X M e^-X, in X and s together. So
Newton's method on kappa s + barrier, kappa growing, finds the least s = log || N ||^2, also where the two largest
singular values meet, at which a descent stalls. It begins where Osborne's balancing ends (J. ACM 7(4), 1960), so
units that differ by any power of ten cost nothing.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SWEEPS = 10
"""Of Osborne's balancing."""

STEPS, GROWTH, LAST = 32, 4.0, 1e7
"""Newton steps; kappa's growth from one to the next, and where it ends: the bound is then within 1 / LAST."""

CHUNK = 24
"""So many matrices are optimized together, the most promising ones first."""


def structured_bounds(M: ComplexArray, floor: Array | None = None) -> tuple[Array, Array]:
    """Bounds (N,) of matrices (N, k, k) and the positive diagonals (N, k) that give them.

    Every matrix that could have the largest bound is optimized, the others are only balanced: their bounds hold but
    are not the least. `floor` (N, k, k) keeps the scaling of entries that vanish within reason; it scales as M does.
    """
    scales = balanced_scales(M, floor)
    bounds = _sizes(_scaled(M, scales))
    if M.shape[1] == 1:
        return bounds, scales
    order, done = np.argsort(-bounds), 0
    while done < len(M) and bounds[order[done]] > np.max(bounds[order[:done]], initial=0.0):
        chunk = order[done : done + CHUNK]
        bounds[chunk], scales[chunk] = optimal_scales(M[chunk], scales[chunk])
        done += len(chunk)
    return bounds, scales


def balanced_scales(M: ComplexArray, floor: Array | None = None) -> Array:
    """Diagonals (N, k) for which every row of D M D^-1 is as large as its column, Osborne's balancing."""
    k = M.shape[1]
    powers = np.abs(M) ** 2 if floor is None else np.abs(M) ** 2 + floor**2
    powers = powers * (1.0 - np.eye(k))
    squares = np.ones(M.shape[:2])
    for _ in range(SWEEPS if k > 1 else 0):
        for i in range(k):
            row = squares[:, i] * np.sum(powers[:, i, :] / squares, axis=1)
            column = np.sum(powers[:, :, i] * squares, axis=1) / squares[:, i]
            least = 1e-10 * (row + column) + 1e-300  # a row of zeros must not have its way
            squares[:, i] *= np.sqrt((column + least) / (row + least))
    return np.sqrt(squares)


def optimal_scales(M: ComplexArray, scales: Array) -> tuple[Array, Array]:
    """The least bounds and their diagonals, from diagonals to begin with."""
    M, k = _scaled(M, scales), M.shape[1]
    unit, picks = np.eye(k), np.einsum("ij,ik->ijk", np.eye(k), np.eye(k))[1:]
    at = np.zeros((len(M), k))  # [s, X_2 … X_k], X_1 = 0
    bounds, best = _sizes(M), at.copy()
    sizes = bounds
    at[:, 0] = 2.0 * np.log(np.maximum(sizes, 1e-300)) + 0.5
    kappa = np.full(len(M), float(k))
    for _ in range(STEPS):
        N = _turned(M, at) * np.exp(-0.5 * at[:, :1, None])
        step, decrement = _newton(N, kappa, unit, picks)
        step /= np.where(decrement < 0.25, 1.0, 1.0 + decrement)[:, None]
        for _ in range(20):
            sizes = _sizes(_turned(M, at + step))
            outside = ~(2.0 * np.log(np.maximum(sizes, 1e-300)) < at[:, 0] + step[:, 0])
            if not np.any(outside):
                break
            step[outside] *= 0.5
        step[outside] = 0.0
        at = at + step
        better = ~outside & (sizes < bounds)
        bounds, best = np.where(better, sizes, bounds), np.where(better[:, None], at, best)
        kappa = np.where(decrement < 1.0, np.minimum(GROWTH * kappa, LAST * k), kappa)
    best[:, 0] = 0.0
    return bounds, scales * np.exp(best)


def _newton(N: ComplexArray, kappa: Array, unit: Array, picks: Array) -> tuple[Array, Array]:
    """Newton's step in (s, X_2 … X_k) for kappa s - log det(1 - N* N), and its decrement."""
    first = np.concatenate([-N[:, None] / 2.0, picks @ N[:, None] - N[:, None] @ picks], axis=1)
    second = np.concatenate([-first[:, :, None] / 2.0, picks @ first[:, :, None] - first[:, :, None] @ picks], axis=2)
    half = _star(N)[:, None] @ first
    inverse = np.linalg.inv(unit - _star(N) @ N)
    slopes = inverse[:, None] @ (half + _star(half))
    bends = _star(first)[:, :, None] @ first[:, None] + _star(N)[:, None, None] @ second
    gradient = np.einsum("naii->na", slopes).real
    gradient[:, 0] += kappa
    hessian = np.einsum("naij,nbji->nab", slopes, slopes).real + 2.0 * np.einsum("nij,nabji->nab", inverse, bends).real
    hessian += 1e-12 * np.trace(hessian, axis1=1, axis2=2)[:, None, None] * unit
    step = -np.linalg.solve(hessian, gradient[:, :, None])[:, :, 0]
    return step, np.sqrt(np.maximum(-np.sum(gradient * step, axis=1), 0.0))


def _turned(M: ComplexArray, at: Array) -> ComplexArray:
    return _scaled(M, np.exp(np.concatenate([np.zeros((len(at), 1)), at[:, 1:]], axis=1)))


def _scaled(M: ComplexArray, scales: Array) -> ComplexArray:
    return np.asarray(M * scales[:, :, None] / scales[:, None, :])


def _sizes(M: ComplexArray) -> Array:
    return np.asarray(np.linalg.norm(M, 2, axis=(1, 2)))


def _star(M: ComplexArray) -> ComplexArray:
    return np.asarray(M.conj().swapaxes(-1, -2))

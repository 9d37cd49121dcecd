"""A discrete system on the unit circle, and its stability."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

STABLE = 1.0 - 1e-9
"""A spectral radius from here on counts as unstable: what rounding leaves of a mode on the unit circle."""


def spectral_radius(A: Array) -> float:
    """Largest magnitude of the eigenvalues of A; 0 for an empty matrix."""
    return float(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0))


def response(system: Any, angles: Array) -> ComplexArray:
    """G(e^{j angle}), shape (len(angles), outputs, inputs); angles in rad per sample.

    By Gaussian elimination at each angle: a Schur form would be faster, but mixes states of very different
    size and so drowns what cancels (the command leak) in rounding.
    """
    count, n = len(angles), len(system.A)
    out = np.broadcast_to(system.D.astype(complex), (count, *system.D.shape)).copy()
    if n:
        B, identity = system.B.astype(complex), np.eye(n)
        for part in np.array_split(np.arange(count), max(1, count * n * n // 1_000_000)):
            z = np.exp(1j * angles[part])[:, None, None]
            out[part] += system.C @ np.linalg.solve(z * identity - system.A, np.broadcast_to(B, (len(part), *B.shape)))
    return out


def gains(system: Any, angles: Array) -> Array:
    """Largest singular value of G at each angle."""
    return largest(response(system, angles))


def largest(G: ComplexArray) -> Array:
    """Largest singular value of each matrix of a stack (., p, m)."""
    if min(G.shape[1:]) == 1:
        return np.asarray(np.linalg.norm(G, axis=(1, 2)))
    return np.asarray(np.linalg.svd(G, compute_uv=False)[:, 0])

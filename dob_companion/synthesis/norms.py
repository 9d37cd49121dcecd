"""Frequency response and H-infinity norm of discrete systems: what certificates are measured with.

The norm follows Bruinsma and Steinbuch (Systems & Control Letters 14, 1990): at a level gamma the
frequencies where a singular value of G crosses it are the unit-circle eigenvalues of a symplectic
pencil, so each step either raises the lower bound or proves the level. It is formed without inverting
anything, so poles at z = 0 (delays) and levels equal to a singular value of D do no harm; python-control's
own routine refuses the former without slycot.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.synthesis.reduce import balanced

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

TOLERANCE = 1e-9
"""Relative width of the final bracket of the norm; the upper end is reported."""


def spectral_radius(A: Array) -> float:
    """Largest magnitude of the eigenvalues of A; 0 for an empty matrix."""
    return float(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0))


def response(system: Any, angles: Array) -> ComplexArray:
    """G(e^{j angle}), shape (len(angles), outputs, inputs); angles in rad per sample.

    By Gaussian elimination at each angle: a Schur form would be faster, but mixes states of very different
    size and so drowns what cancels (the command leak) in rounding.
    """
    count, n = len(angles), system.nstates
    out = np.broadcast_to(system.D.astype(complex), (count, *system.D.shape)).copy()
    if n:
        B, identity = system.B.astype(complex), np.eye(n)
        for part in np.array_split(np.arange(count), max(1, count * n * n // 1_000_000)):
            z = np.exp(1j * angles[part])[:, None, None]
            out[part] += system.C @ np.linalg.solve(z * identity - system.A, np.broadcast_to(B, (len(part), *B.shape)))
    return out


def gains(system: Any, angles: Array) -> Array:
    """Largest singular value of G at each angle."""
    G = response(system, angles)
    if min(G.shape[1:]) == 1:
        return np.asarray(np.linalg.norm(G, axis=(1, 2)))
    return np.asarray(np.linalg.svd(G, compute_uv=False)[:, 0])


def angle_grid(A: Array, count: int = 600) -> Array:
    """Angles 0…pi rad per sample: logarithmic, linear, and close around every resonance of A."""
    poles = np.linalg.eigvals(A) if len(A) else np.zeros(0)
    around = [np.zeros(1)]
    for pole in poles[np.abs(poles) > 1e-3]:
        width = max(1.0 - abs(pole), 1e-6)
        around.append(abs(np.angle(pole)) + width * np.array([-3.0, -1.0, -0.3, 0.0, 0.3, 1.0, 3.0]))
    half = count // 2
    grid = np.concatenate([np.geomspace(1e-5, np.pi, half), np.linspace(0.0, np.pi, half), *around])
    return np.unique(np.clip(grid, 0.0, np.pi))


def hinf_norm(system: Any) -> tuple[float, float]:
    """H-infinity norm and the angle (rad per sample) of its peak; (inf, nan) for an unstable system.

    The value is the proven upper end of a bracket of relative width 2e-9.
    """
    if spectral_radius(system.A) >= 1.0:
        return float("inf"), float("nan")
    system = balanced(system)
    angles = angle_grid(system.A)
    sizes = gains(system, angles)
    peak, where = float(np.max(sizes)), float(angles[np.argmax(sizes)])
    for _ in range(40):
        level = peak * (1.0 + 2.0 * TOLERANCE)
        candidates = _crossings(system, level) if level > 0 else np.zeros(0)
        if candidates.size == 0:
            return level, where
        sizes = gains(system, candidates)
        if np.max(sizes) <= level:
            return level, where
        peak, where = float(np.max(sizes)), float(candidates[np.argmax(sizes)])
    return level, where


def _crossings(system: Any, level: float) -> Array:
    """Angles to look at: every pencil eigenvalue near the unit circle, and the midpoints between them.

    "Near" is generous: a false candidate costs one evaluation, a missed one would cost the proof.
    """
    A, B, C, D = system.A, system.B, system.C, system.D / level
    n, (p, m) = system.nstates, system.D.shape
    size = 2 * n + m + p
    M, N = np.zeros((size, size)), np.zeros((size, size))
    x, q, u, y = slice(0, n), slice(n, 2 * n), slice(2 * n, 2 * n + m), slice(2 * n + m, size)
    share = np.sqrt(level)
    N[x, x], M[x, x], M[x, u] = np.eye(n), A, B / share  # z x = A x + B u
    M[q, q], M[q, y], N[q, q] = np.eye(n), -C.T / share, A.T  # q = z A' q + C' y
    M[u, u], M[u, y], N[u, q] = -np.eye(m), D.T, -B.T / share  # level u = z B' q + D' y
    M[y, x], M[y, u], M[y, y] = C / share, D, -np.eye(p)  # level y = C x + D u
    top, bottom = linalg.eig(M, N, right=False, homogeneous_eigvals=True)
    near = np.abs(np.abs(top) - np.abs(bottom)) < 1e-4 * np.abs(bottom)
    angles = np.sort(np.abs(np.angle(top[near] / bottom[near])))
    return np.concatenate([angles, (angles[1:] + angles[:-1]) / 2.0]) if angles.size else angles

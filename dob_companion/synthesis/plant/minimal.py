"""Hidden modes found and removed by balancing.

A mode that cannot be reached or seen does not change what a system does, but rounding makes it
*almost* hidden: balanced coordinates rank states by how much they matter between input and output
(Moore, IEEE TAC 26, 1981), and those at rounding level go. Systems with poles on or outside the unit
circle are balanced at a larger radius, G(rho z): reachability and observability do not depend on rho.
"""

from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.lti.gramian import gramian_root
from dob_companion.lti.response import spectral_radius

Array = NDArray[np.float64]

HIDDEN = (1e-8, 1e-10, 1e-12, 0.0)
"""Shares of the largest Hankel singular value below which a state counts as hidden, in order of trial."""


def minimal(system: Any, tolerance: float = HIDDEN[0]) -> Any:
    """The system without its hidden modes; the order is unchanged when there are none.

    Inputs and outputs are weighed alike whatever their units. States are returned balanced.
    """
    n = system.nstates
    if n == 0 or tolerance == 0.0:
        return system
    left, right, values = _balancing(system)
    keep = int(np.sum(values > tolerance * values[0])) if values[0] > 0 else 0
    if keep == n:
        return system
    T, Ti = right[:, :keep], left[:keep]
    return ct.ss(Ti @ system.A @ T, Ti @ system.B, system.C @ T, system.D, system.dt)


def balanced(system: Any) -> Any:
    """The same system in balanced coordinates, in which rounding hurts least."""
    if system.nstates == 0:
        return system
    left, right, values = _balancing(system)
    if values[-1] <= 1e-14 * values[0]:
        return system
    return ct.ss(left @ system.A @ right, left @ system.B, system.C @ right, system.D, system.dt)


def hidden_modes(system: Any, tolerance: float = HIDDEN[0]) -> NDArray[np.complex128]:
    """Eigenvalues of A that do not appear in the transfer function."""
    poles = list(np.linalg.eigvals(system.A).astype(complex))
    for pole in np.linalg.eigvals(minimal(system, tolerance).A):
        poles.pop(int(np.argmin([abs(p - pole) for p in poles])))
    return np.array(poles, dtype=complex)


def _balancing(system: Any) -> tuple[Array, Array, Array]:
    """Left and right balancing transformations (inverse to each other) and the Hankel singular values."""
    radius = spectral_radius(system.A)
    shrink = 1.0 if radius < 0.99999 else 1.0 / (1.02 * radius)
    A, B = shrink * system.A, _unit_columns(system.B)
    reach = np.linalg.norm(gramian_root(A, B), axis=1)
    reach = np.where(reach > 1e-14 * np.max(reach), reach, 1.0)  # an unreachable state may have any scale
    A, B, C = A * reach / reach[:, None], B / reach[:, None], _unit_columns((system.C * reach).T).T
    Lp, Lq = gramian_root(A, B), gramian_root(A.T, C.T)
    U, values, Vt = np.linalg.svd(Lq.T @ Lp)
    root = np.sqrt(np.maximum(values, 1e-300))
    return (U / root).T @ Lq.T / reach, reach[:, None] * (Lp @ Vt.T / root), values


def _unit_columns(M: Array) -> Array:
    norms = np.linalg.norm(M, axis=0)
    return M / np.where(norms > 0, norms, 1.0)

"""H-infinity norm of discrete systems: what certificates are measured with.

The norm is bounded arc by arc of the unit circle (`arcs.py`) and the arcs are cut where the bound is not yet near the
largest gain measured: branch and bound. The usual test of a level, by the unit-circle eigenvalues of a Hamiltonian or
symplectic pencil (Boyd and Balakrishnan, Systems & Control Letters 15, 1990; Bruinsma and Steinbuch, same journal 14,
1990), is no proof where poles are close together: rounding moves those eigenvalues off the circle and a peak is
overlooked.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import NotConvergedError
from dob_companion.lti.response import spectral_radius
from dob_companion.synthesis.norms.arcs import Scaling, gain_bracket

Array = NDArray[np.float64]

TOLERANCE = 1e-9
"""Relative width of the final bracket of the norm; the upper end is reported."""

LOOSEST = 1e-5
"""A wider bracket is no answer."""


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


def hinf_norm(system: Any, tolerance: float = TOLERANCE, scaling: Scaling | None = None) -> tuple[float, float]:
    """H-infinity norm and the angle (rad per sample) of its peak; (inf, nan) for an unstable system.

    The value is an upper bound at every frequency: proved, with an allowance for rounding, and `tolerance` (relative)
    above a gain measured at that angle unless rounding makes it more. With a `scaling` the norm is that of the scaled
    system (`arcs.Scaling`).

    Raises NotConvergedError rather than return anything wider than LOOSEST.
    """
    if spectral_radius(system.A) >= 1.0:
        return float("inf"), float("nan")
    found = gain_bracket(system, tolerance, scaling=scaling)
    if not found.converged and not found.high <= found.low * (1.0 + LOOSEST):
        raise NotConvergedError(
            f"the norm of a system of order {system.nstates} lies between {found.low:.7g} and {found.high:.7g}: no "
            "nearer bounds were found"
        )
    return found.high + found.rounding, found.angle

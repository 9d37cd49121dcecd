"""The worst stable w(z) within a multiplicative bound, as a system: the proof that a bound on stability is tight.

A narrow band-pass of gain 1 and phase 0 at one frequency times a first-order all-pass of the phase wanted there
(the standard construction behind the small-gain theorem: Zhou, Doyle, Glover, "Robust and Optimal Control", 1996,
theorem 9.1), made narrower until it keeps within the bound at every frequency.
"""

from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import NotConvergedError
from dob_companion.lti.response import response
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.robust.interconnection import Interconnection
from dob_companion.synthesis.spec.uncertainty import Uncertainty

Array = NDArray[np.float64]

WIDTHS = np.append(np.geomspace(0.5, 1e-3, 10), np.geomspace(5e-4, 1e-6, 10))
"""Of the band-pass in rad per sample, in order of trial; the narrow ones are for bounds that rise in a step."""


def destabilized(grid: Interconnection, uncertainty: Uncertainty, factor: Any) -> list[Any]:
    """factor * diag(1 + w_i), w_i aimed at the frequency where channel i alone comes closest to the edge of stability.

    Empty without a multiplicative bound. Raises NotConvergedError where the bound is too narrow for any of WIDTHS.
    """
    bounds = [channel.multiplicative for channel in uncertainty.channels]
    if not any(bounds):
        return []
    found = []
    inside = (grid.angles > 1e-3) & (grid.angles < np.pi - 1e-3)
    hertz = grid.angles / (2.0 * np.pi * grid.dt)
    phi = np.diagonal(response(factor, grid.angles), axis1=1, axis2=2)
    loop = grid.seen_by(phi)
    for i, channel in enumerate(uncertainty.channels):
        if not channel.multiplicative:
            continue
        bound = np.interp(hertz, channel.frequency_hz, channel.multiplicative)
        around = loop[:, i, i] * phi[:, i]  # once around w
        k = int(np.argmax(np.where(inside, bound * np.abs(around), 0.0)))
        phase = -float(np.angle(around[k]))  # so that around w >= 1 there: a pole on the circle, or beyond
        w = _within(grid.angles, bound, float(grid.angles[k]), float(bound[k]), phase, grid.dt)
        one = ct.ss([], [], [], [[1.0]], grid.dt)
        found.append(factor * stack([one + w if j == i else one for j in range(len(bounds))]))
    return found


def _within(angles: Array, bound: Array, angle: float, size: float, phase: float, dt: float) -> Any:
    """The widest w that keeps within the bound; a band of some width always does where the bound is continuous."""
    for width in WIDTHS:
        w = size * all_pass(angle, phase, dt) * band_pass(angle, float(width), dt)
        if np.all(np.abs(response(w, angles)[:, 0, 0]) <= bound * (1.0 + 1e-9)):
            return w
    raise NotConvergedError(
        f"no factor of gain {size:.4g} at {angle / (2.0 * np.pi * dt):.4g} Hz keeps within the multiplicative bound "
        f"beside it: expected a bound that is as large for more than {WIDTHS[-1] / (2.0 * np.pi * dt):.2g} Hz"
    )


def band_pass(angle: float, width: float, dt: float) -> Any:
    """(1 - a) / 2 (z^2 - 1) / (z^2 - (1 + a) cos(angle) z + a): gain 1 and phase 0 at `angle`, below 1 elsewhere."""
    a = 1.0 - width
    num, den = [(1.0 - a) / 2.0, 0.0, -(1.0 - a) / 2.0], [1.0, -(1.0 + a) * np.cos(angle), a]
    return ct.ss(ct.tf(num, den, dt))


def all_pass(angle: float, phase: float, dt: float) -> Any:
    """+-(1 - b z) / (z - b), |b| < 1, with the given phase at `angle`."""
    z = np.exp(1j * angle)
    wanted = float(np.mod(phase, 2.0 * np.pi))  # phase runs from 2 pi - angle … down to … by b from -1 to 1
    for sign in (1.0, -1.0):
        turned = sign * np.exp(1j * wanted)
        # (1 - b z) = turned (z - b)  =>  b = (1 - turned z) / (z - turned), real for every |turned| = 1
        b = (1.0 - turned * z) / (z - turned) if abs(z - turned) > 1e-12 else complex(2.0)
        if abs(b) < 1.0 - 1e-9:
            return sign * ct.ss([[b.real]], [[1.0]], [[1.0 - b.real**2]], [[-b.real]], dt)
    return ct.ss([], [], [], [[float(np.sign(np.cos(wanted)))]], dt)

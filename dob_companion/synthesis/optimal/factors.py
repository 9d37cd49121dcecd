"""Uncertain plants as limits of the programme.

The true plant is phi G, and the loop with the observer has 1 + (phi - 1) X, X = 1 - S T_f, in its denominator (d_hat
believes in G; the factor acts on v = u_e + d, and X is what v is answered with). Where that keeps out of the origin for
every phi of a connected set, all of its plants are stable when one is. X is affine in F, so a line between the origin
and the values at all phi makes it convex::

    Re(u (1 + (phi - 1) X)) - w |phi X| >= ROOM            |u| = 1, phi (1 + w e^jt) for a multiplicative bound w

u, the direction of the line at each angle, is taken anew from the last F: the one farthest from the origin.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dob_companion.synthesis.optimal.limits import Limit
from dob_companion.synthesis.optimal.problem import Responses

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ROOM, SHARE = 0.03, 0.5
"""Distance kept from the origin, and at most this share of what the loop without observer keeps."""

STEPS = ((np.pi / 12, 11), (np.pi / 60, 4), (np.pi / 300, 4))
"""Directions tried: a step and how many of it to either side, each round about the best of the last."""


@dataclass(frozen=True, slots=True, eq=False)
class Factors:
    """phi (count, N) of the plants that must be stable, and the multiplicative bound w (N,) on top of each."""

    phi: Complex
    bound: Array

    def limits(self, on: Responses, F: Complex) -> list[Limit]:
        """One for each phi, with lines turned to suit an F."""
        turn, _ = self._turned(on, F)
        room = np.minimum(ROOM, SHARE * np.maximum(self.apart(on), 1e-9))
        rest, forward = (1.0 - on.S) / room, on.S * on.late * on.N / room
        return [
            Limit(
                "the plant's uncertainty",
                turn / room + turn * (phi - 1.0) * rest,
                turn * (phi - 1.0) * forward,
                1.0,
                half_plane=True,
                around=(self.bound * np.abs(phi) * rest, self.bound * np.abs(phi) * forward)
                if np.any(self.bound)
                else None,
            )
            for phi in self.phi
        ]

    def apart(self, on: Responses) -> Array:
        """Distance that the loop without observer keeps from the origin, at each angle."""
        return self._turned(on, np.zeros_like(on.S))[1]

    def _turned(self, on: Responses, F: Complex) -> tuple[Complex, Array]:
        """The best direction at each angle, and the distance from the origin there."""
        X = 1.0 - on.sensitivity(F)
        values, radii = 1.0 + (self.phi - 1.0) * X, self.bound * np.abs(self.phi * X)
        best, apart = np.zeros(len(X)), np.full(len(X), -np.inf)
        for step, reach in STEPS:
            middle = best
            for way in range(-reach, reach + 1):
                here = np.min((np.exp(1j * (middle + way * step)) * values).real - radii, axis=0)
                better = here > apart
                apart, best = np.where(better, here, apart), np.where(better, middle + way * step, best)
        return np.exp(1j * best), apart

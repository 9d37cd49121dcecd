"""The conventional disturbance observer: d_hat = Q z^-m (G_n^-1 y_n - u_e), Butterworth Q, approximate inverse.

Structure: K. Ohnishi, "A new servo method in mechatronics", Trans. JSEE 107-D, 1987; T. Umeno and Y. Hori, "Robust
speed control of DC servomotors using modern two degrees-of-freedom controller design", IEEE Trans. Industrial
Electronics 38(5), 1991 (Butterworth Q). m is the least delay that makes Q z^-m G_n^-1 causal.

Inverse of G = k B_a(z) B_u(z) / A(z), B_u holding the zeros on or outside the unit circle (s of them):

- ZPETC, zero phase error tracking: M. Tomizuka, "Zero phase error tracking algorithm for digital control",
  ASME J. Dynamic Systems, Measurement, and Control 109(1), 1987:  A(z) B_u(1/z) / (k B_a(z) B_u(1)^2).
  G G_n^-1 = B_u(z) B_u(1/z) / B_u(1)^2 has exactly zero phase.
- ZMETC, zero magnitude error: J. A. Butterworth, L. Y. Pao, D. Y. Abramovitch, "The effect of nonminimum-phase zero
  locations on the performance of feedforward model-inverse control techniques in discrete-time systems",
  American Control Conference, 2008:  A(z) / (k B_a(z) z^s B_u(1/z)).  |G G_n^-1| = 1 exactly.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.comparison.rational import (
    ON_CIRCLE,
    NotApplicableError,
    low_passed,
    observer_from,
    polynomial,
    power,
    product,
    reversed_in_z,
    roots_of,
)

Array = NDArray[np.float64]

INVERSES = ("ZPETC", "ZMETC")


def approximate_inverse(plant: Any, method: str) -> tuple[Array, Array]:
    """Numerator and denominator of G_n^-1, descending in z and not causal: the numerator has the higher degree.

    Raises NotApplicableError when the method has no stable inverse for this plant.
    """
    g = roots_of(plant)
    A, B_a, B_u = polynomial(g.poles), polynomial(g.inner, g.gain), polynomial(g.outer)
    if method == "ZPETC":
        dc = float(np.sum(B_u))
        if abs(dc) < 1e-6 * float(np.sum(np.abs(B_u))):
            raise NotApplicableError("ZPETC needs a plant without a zero at z = 1")
        return product(A, reversed_in_z(B_u)), product(B_a, power(len(g.outer))) * dc**2
    if np.any(np.abs(g.outer) <= 1.0 + ON_CIRCLE):
        raise NotApplicableError("ZMETC needs a plant without zeros on the unit circle")
    return A, product(B_a, reversed_in_z(B_u))


def conventional(plant: Any, method: str, order: int, hertz: float) -> Any:
    """D(z) with a Butterworth Q of this order and -3 dB frequency, by one of INVERSES.

    Raises NotApplicableError, see `approximate_inverse`.
    """
    above, below = approximate_inverse(plant, method)
    late = power(len(above) - len(below))
    return low_passed(observer_from(above, -below, product(below, late), float(plant.dt)), order, hertz)

"""A zero-order hold whose steps act late, by any fraction of a sample."""

import math
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

Array = NDArray[np.float64]

ROUNDING = 1e-9
"""A share of a sample that is not told from a whole one."""


def held_back(system: Any, dt: float, delay_s: float) -> Any:
    """Discrete system of a continuous one whose inputs, held for dt (s), act `delay_s` >= 0 late; exact.

    Within a sample the old input acts for the fraction of the delay and the new one for the rest: x(k+1) = Phi x(k) +
    Gamma_1 u(k-1) + Gamma_0 u(k) (Astrom and Wittenmark, "Computer-Controlled Systems", 3rd ed. 1997, section 3.2).
    The states of the system come first, then the inputs that are still under way, the oldest first.
    """
    whole = math.floor(delay_s / dt + ROUNDING)
    part = max(0.0, delay_s - whole * dt)
    n, m = system.B.shape
    phi_old, old = _held(system, part)
    phi_new, new = _held(system, dt - part)
    late = whole + (part > ROUNDING * dt)
    size = n + m * late
    oldest, under_way = slice(n, n + m), slice(n, size)
    A, B = np.zeros((size, size)), np.zeros((size, m))
    C, D = np.zeros((len(system.C), size)), np.zeros_like(system.D)
    A[:n, :n], C[:, :n] = phi_new @ phi_old, system.C
    queue = np.eye(size + m, k=m)[under_way, :]  # each input moves on by one place; the new one comes last
    A[under_way, :], B[under_way, :] = queue[:, :size], queue[:, size:]
    if late > whole:  # the oldest acts first, that behind it for the rest of the sample
        A[:n, oldest] = phi_new @ old
        behind = slice(n + m, n + 2 * m)
        if late > 1:
            A[:n, behind] = new
        else:
            B[:n] = new
        C[:, oldest] = system.D
    elif late:
        A[:n, oldest] = phi_old @ new
        C[:, oldest] = system.D
    else:
        B[:n], D = new, np.asarray(system.D)
    return ct.ss(A, B, C, D, dt)


def _held(system: Any, span: float) -> tuple[Array, Array]:
    """Phi and Gamma of a constant input over `span` seconds."""
    n, m = system.B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = system.A, system.B
    power = linalg.expm(block * span)
    return power[:n, :n], power[:n, n:]

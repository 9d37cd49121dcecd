"""Plants as roots, and observers written as transfer functions: D(z) = [num_y, num_u] / den."""

from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import signal

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ON_CIRCLE = 1e-6
"""Distance from the unit circle within which a root counts as lying on it."""


class NotApplicableError(ValueError):
    """A method has no form for this plant; the text says what it lacks."""


@dataclass(frozen=True, slots=True, eq=False)
class Roots:
    """gain * prod(z - zeros) / prod(z - poles), strictly proper; `zeros` split by what an inverse may do with them.

    inner zeros lie inside the unit circle and may be cancelled; outer ones lie on or outside it.
    """

    inner: Complex
    outer: Complex
    poles: Complex
    gain: float

    @property
    def relative_degree(self) -> int:
        """Samples from a moment to the first rate that it moves."""
        return len(self.poles) - len(self.inner) - len(self.outer)


def roots_of(plant: Any) -> Roots:
    """Roots and gain of a SISO system without a direct term."""
    zeros, poles = np.asarray(plant.zeros(), dtype=complex), np.asarray(plant.poles(), dtype=complex)
    outside = np.abs(zeros) >= 1.0 - ON_CIRCLE
    return Roots(zeros[~outside], zeros[outside], poles, leading_gain(plant, len(poles) - len(zeros)))


def leading_gain(system: Any, relative_degree: int) -> float:
    """The gain beside monic factors: the first value of a SISO system's impulse response that is not 0."""
    if relative_degree == 0:
        return float(system.D[0, 0])
    reach = system.B
    for _ in range(relative_degree - 1):
        reach = system.A @ reach
    return float((system.C @ reach)[0, 0])


def polynomial(roots: Complex, gain: float = 1.0) -> Array:
    """Coefficients of gain * prod(z - roots), descending."""
    return gain * np.atleast_1d(np.real(np.poly(roots))) if len(roots) else np.array([gain])


def reversed_in_z(p: Array) -> Array:
    """z^n p(1/z): every root r becomes 1/r, and magnitudes on the unit circle stay."""
    return p[::-1]


def product(*polynomials: Array) -> Array:
    """Product of polynomials in descending coefficients."""
    out = np.ones(1)
    for p in polynomials:
        out = np.convolve(out, p)
    return out


def power(n: int) -> Array:
    """z^n."""
    return np.eye(1, n + 1).ravel()


def observer_from(num_y: Array, num_u: Array, den: Array, dt: float) -> Any:
    """D(z) from its rates' and moments' numerators over one denominator, in observable canonical form.

    Raises ValueError when it is not causal or answers u_e at once.
    """
    n = len(den) - 1
    rows = []
    for num in (num_y, num_u):
        trimmed = num[max(len(num) - n - 1, 0) :]
        if len(num) > n + 1 and np.max(np.abs(num[: len(num) - n - 1])) > 1e-9 * np.max(np.abs(num)):
            raise ValueError(f"numerator of degree {len(num) - 1} over {n}: not causal")
        rows.append(np.concatenate([np.zeros(n + 1 - len(trimmed)), trimmed]) / den[0])
    a, b = den / den[0], np.stack(rows, axis=1)
    if abs(b[0, 1]) > 1e-9 * np.max(np.abs(b[:, 1]), initial=1e-300):
        raise ValueError("direct path from u_e")
    b[0, 1] = 0.0
    A, C = np.eye(n, k=1), np.eye(1, n)
    A[:, 0] = -a[1:]
    return ct.ss(A, b[1:] - np.outer(a[1:], b[0]), C, b[:1], dt)


def low_passed(observer: Any, order: int, hertz: float) -> Any:
    """An observer with a Butterworth low-pass of this order and -3 dB frequency behind d_hat.

    In sections, one for each real pole or pair: a companion form of higher order loses a slow filter's poles to
    rounding. Every zero of a Butterworth filter lies at z = -1, its gain at frequency 0 is 1.
    """
    dt = float(observer.dt)
    _, poles, _ = signal.butter(order, hertz, fs=1.0 / dt, output="zpk")
    for pole in poles[poles.imag > -1e-12]:
        den = polynomial(np.array([pole, pole.conjugate()] if pole.imag > 1e-12 else [pole.real], dtype=complex))
        num = polynomial(-np.ones(len(den) - 1, dtype=complex))
        observer = ct.ss(*signal.tf2ss(num * np.sum(den) / np.sum(num), den), dt) * observer
    return observer

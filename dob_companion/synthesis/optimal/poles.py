"""Poles of an observer as free numbers, so that a descent cannot leave the disk that they must lie in.

a(z) is a product of sections z^2 + c1 z + c2, one of first order when their number is odd. Schur and Cohn: the roots of
a section lie within radius ρ exactly when c2 = ρ^2 k2 and c1 = ρ k1 (1 + k2) with |k1|, |k2| < 1; k = tanh x is free.
Real poles become a complex pair and the other way round without any seam.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FARTHEST = 3.5
"""|x| at most: tanh is then within 0.2 % of its end, and its slope has not vanished."""


def sections(x: Array, radius: float) -> list[Array]:
    """Monic polynomials (descending) of free numbers x, two each; the last one of first order for an odd count."""
    k = np.tanh(np.clip(x, -FARTHEST, FARTHEST))
    pairs = [
        np.array([1.0, radius * k[i] * (1.0 + k[i + 1]), radius**2 * k[i + 1]])
        for i in range(0, len(x) - len(x) % 2, 2)
    ]
    return [*pairs, np.array([1.0, -radius * k[-1]])] if len(x) % 2 else pairs


def slopes(x: Array, radius: float, z: Complex) -> Complex:
    """d log a / dx at each z, (len(z), len(x))."""
    k = np.tanh(np.clip(x, -FARTHEST, FARTHEST))
    bend = np.where(np.abs(x) < FARTHEST, 1.0 - k**2, 0.0)
    out = np.empty((len(z), len(x)), complex)
    for i, section in zip(range(0, len(x), 2), sections(x, radius), strict=True):
        s = np.polyval(section, z)
        if len(section) == 2:
            out[:, i] = -radius / s * bend[i]
            continue
        out[:, i] = radius * (1.0 + k[i + 1]) * z / s * bend[i]
        out[:, i + 1] = (radius * k[i] * z + radius**2) / s * bend[i + 1]
    return out


def free(poles: Complex, radius: float) -> Array:
    """The free numbers of poles within the radius; conjugates in full, real poles in any number."""
    real = sorted(float(p.real) for p in poles if abs(p.imag) <= 1e-12)
    upper = sorted((p for p in poles if p.imag > 1e-12), key=lambda p: (p.real, p.imag))
    pairs = [(-2.0 * p.real, abs(p) ** 2) for p in upper]
    pairs += [(-(p + q), p * q) for p, q in zip(real[0:-1:2], real[1::2], strict=False)]
    out = []
    for c1, c2 in pairs:
        k2 = c2 / radius**2
        out += [c1 / radius / (1.0 + k2), k2]
    if len(real) % 2:
        out.append(real[-1] / radius)
    return np.asarray(np.arctanh(np.clip(out, -np.tanh(FARTHEST), np.tanh(FARTHEST))))


def roots(x: Array, radius: float) -> Complex:
    """The poles, section by section."""
    return np.asarray(np.concatenate([np.roots(section) for section in sections(x, radius)]), dtype=complex)


def monic(x: Array, radius: float) -> Array:
    """a(z), descending."""
    a = np.ones(1)
    for section in sections(x, radius):
        a = np.convolve(a, section)
    return a

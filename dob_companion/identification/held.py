"""A continuous plant behind a hold: its input steps at each sample and its output is read there, after any delay.

For each pole p with residue r, x' = p x + r u, an input that steps at the samples and comes d whole samples and a part
e of one late gives x(k+1) = exp(p dt) x(k) + r g(dt - e) u(k-d) + r (g(dt) - g(dt - e)) u(k-d-1), with
g(t) = (exp(p t) - 1) / p (Åström and Wittenmark, *Computer-Controlled Systems*, 3rd ed. 1997, systems with time
delays). Summed over the poles this is exact.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

APART = 1e-5
"""Relative distance to which poles that coincide are spread: residues of simple poles are all that is used."""


def held_response(
    num: Sequence[float], den: Sequence[float], delay_s: float, dt: float, frequency: Floats
) -> Complexes:
    """Frequency response, shape of `frequency` (rad/s), of num/den (descending powers of s, strictly proper).

    Raises ValueError for a plant that is not strictly proper or a negative delay.
    """
    poles, residues = _simple(num, den)
    if delay_s < 0.0:
        raise ValueError(f"delay {delay_s:g} s; expected 0 or more")
    whole, part = _split(delay_s, dt)
    z = np.exp(1j * np.asarray(frequency, float) * dt)
    old, new = _grown(poles, dt), _grown(poles, dt - part)
    total = np.zeros(z.shape, complex)
    for p, r, b, b_new in zip(poles, residues, old, new, strict=True):
        total += r * (b_new + (b - b_new) / z) / (z - np.exp(p * dt))
    return np.asarray(total * z**-whole)


def _split(delay_s: float, dt: float) -> tuple[int, float]:
    """Whole samples, and what is over in s."""
    whole = int(np.floor(delay_s / dt + 1e-12))
    return whole, max(0.0, delay_s - whole * dt)


def _grown(poles: Complexes, time: float) -> Complexes:
    """(exp(p t) - 1) / p, and t for p = 0."""
    small = np.abs(poles) * max(time, 1e-300) < 1e-9
    safe = np.where(small, 1.0, poles)
    return np.where(small, time, np.expm1(safe * time) / safe)


def _simple(num: Sequence[float], den: Sequence[float]) -> tuple[Complexes, Complexes]:
    """Poles, none twice, and their residues."""
    top, bottom = np.trim_zeros(np.asarray(num, float), "f"), np.trim_zeros(np.asarray(den, float), "f")
    if len(top) >= len(bottom):
        raise ValueError(f"degree {len(top) - 1} over {len(bottom) - 1}; expected a plant that is strictly proper")
    poles = np.sort_complex(np.roots(bottom))
    for k in range(1, len(poles)):
        near = np.abs(poles[:k] - poles[k]) < APART * (1.0 + np.abs(poles[k]))
        poles[k] += 2.0 * APART * (1.0 + np.abs(poles[k])) * np.count_nonzero(near)
    others = poles[:, None] - poles[None, :]
    np.fill_diagonal(others, 1.0)
    residues = np.polyval(top, poles) / (bottom[0] * np.prod(others, axis=1))
    return np.asarray(poles, complex), np.asarray(residues, complex)

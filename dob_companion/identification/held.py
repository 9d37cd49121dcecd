"""A continuous plant behind a hold: its input steps at each sample and its output is read there, after any delay.

For each pole p with residue r, x' = p x + r u, an input that steps at the samples and comes d whole samples and a part
e of one late gives x(k+1) = exp(p dt) x(k) + r g(dt - e) u(k-d) + r (g(dt) - g(dt - e)) u(k-d-1), with
g(t) = (exp(p t) - 1) / p (Åström and Wittenmark, *Computer-Controlled Systems*, 3rd ed. 1997, systems with time
delays). Summed over the poles this is exact.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

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
    top, lead, poles = _factors(num, den)
    return held_by_poles(top, lead, poles, delay_s, dt, frequency)


def held_by_poles(
    top: Sequence[float] | Floats, lead: float, poles: Complexes, delay_s: float, dt: float, frequency: Floats
) -> Complexes:
    """`held_response` of top / (lead prod (s - pole)), which must be strictly proper."""
    if delay_s < 0.0:
        raise ValueError(f"delay {delay_s:g} s; expected 0 or more")
    poles, residues = _simple(top, lead, poles)
    whole, part = _split(delay_s, dt)
    z = np.exp(1j * np.asarray(frequency, float) * dt)
    old, new = _grown(poles, dt), _grown(poles, dt - part)
    at = z[..., None]
    total = np.sum(residues * (new + (old - new) / at) / (at - np.exp(poles * dt)), axis=-1)
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


def _factors(num: Sequence[float], den: Sequence[float]) -> tuple[Floats, float, Complexes]:
    top, bottom = np.trim_zeros(np.asarray(num, float), "f"), np.trim_zeros(np.asarray(den, float), "f")
    if len(top) >= len(bottom):
        raise ValueError(f"degree {len(top) - 1} over {len(bottom) - 1}; expected a plant that is strictly proper")
    return top, float(bottom[0]), np.asarray(np.roots(bottom), complex)


def _simple(top: Sequence[float] | Floats, lead: float, poles: Complexes) -> tuple[Complexes, Complexes]:
    """Poles, none twice, and their residues."""
    poles = np.sort_complex(poles)
    near = np.abs(poles[:, None] - poles[None, :]) < APART * (1.0 + np.abs(poles))
    poles = poles + 2.0 * APART * (1.0 + np.abs(poles)) * np.sum(np.tril(near, -1), axis=1)
    others = poles[:, None] - poles[None, :]
    np.fill_diagonal(others, 1.0)
    value = np.zeros(len(poles), complex)
    for coefficient in top:
        value = value * poles + coefficient
    return poles, value / (lead * np.prod(others, axis=1))


def held_filter(num: Sequence[float], den: Sequence[float], delay_s: float, dt: float, u: Floats) -> Floats:
    """What the plant of `held_response` answers to u, shape (n, channels), from rest."""
    poles, residues = _simple(*_factors(num, den))
    whole, part = _split(delay_s, dt)
    old, new = _grown(poles, dt), _grown(poles, dt - part)
    y = np.zeros(u.shape)
    for p, r, b, b_new in zip(poles, residues, old, new, strict=True):
        if p.imag < -1e-12:
            continue  # the other of its pair answers for both
        answer = lfilter([0.0, r * b_new, r * (b - b_new)], [1.0, -np.exp(p * dt)], u, axis=0)
        y += answer.real * (2.0 if p.imag > 1e-12 else 1.0)
    late = np.zeros_like(y)
    late[whole:] = y[: len(y) - whole]
    return late

"""The observer as state space that keeps its digits, and the weights for which it is H-infinity optimal.

Companion forms lose an observer of order 8 to rounding: its poles cluster. Here the poles are a cascade of all-pass
sections, each an orthogonal matrix [A B; C D], which makes the whole output normal, A'A + C'C = I
(R. A. Roberts, C. T. Mullis, "Digital Signal Processing", 1987, chapter 9): the columns of C (zI - A)^-1 are
orthonormal, and B follows by least squares without loss.

Weights: with W_n = c, and W_d = q z^τ / t where t = z^τ a - b n are the zeros of T_f and |q|^2 = |a|^2 - c^2 |b m|^2,

    |T_f W_d|^2 + |F M W_n|^2 = |q / a|^2 + c^2 |b m / a|^2 = 1        at every frequency.

An error of the same size at every frequency is optimal when it winds often enough around the origin (Z. Nehari, 1957),
and is then the only optimum.
"""

from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.lti.statespace import delay_line
from dob_companion.synthesis.optimal.poles import sections
from dob_companion.synthesis.optimal.problem import Axis
from dob_companion.synthesis.spec.parse import Zpk

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

NOISE_SHARE = 0.7
"""Largest |F M W_n|; any share below 1 gives weights for the same observer."""


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """W_d and W_n, W_n constant."""

    disturbance: Zpk
    noise: Zpk


def realized(axis: Axis, x: Array, radius: float, b: Array) -> Any:
    """D(z) = b [m, -n] / a, inputs [y_n; u_e], output d_hat, output normal; a by its free numbers (`poles`)."""
    return realized_of(axis, sections(x, radius), b)


def realized_of(axis: Axis, parts: list[Array], b: Array) -> Any:
    """The same with a as monic polynomials of degree 1 or 2."""
    A, C = all_pass(parts)
    n, count = len(A), 8 * len(A) + 8
    z = np.exp(1j * np.pi * (np.arange(count) + 0.5) / count)
    a = np.prod([np.polyval(part, z) for part in parts], axis=0)
    D = np.array([b[0], 0.0])
    seen = np.stack([np.polyval(b, z) * np.polyval(axis.m, z), -np.polyval(b, z) * np.polyval(axis.n, z)], axis=1)
    wanted = seen / a[:, None] - D
    through = np.linalg.solve(
        z[:, None, None] * np.eye(n) - A, np.broadcast_to(np.eye(n), (count, n, n)).astype(complex)
    )
    columns = (C.astype(complex) @ through)[:, 0]
    B = np.linalg.lstsq(np.vstack([columns.real, columns.imag]), np.vstack([wanted.real, wanted.imag]), rcond=None)[0]
    return ct.ss(A, B, C, D[None], axis.dt)


def all_pass(parts: list[Array]) -> tuple[Array, Array]:
    """A (n, n) and C (1, n), A'A + C'C = I, with the roots of monic polynomials of degree 1 or 2 as poles."""
    whole = np.eye(1)  # [A B; C D] of a system without states
    for part in parts:
        section, old, new = _section(part), len(whole) - 1, len(part) - 1
        A, B, C, D = section[:new, :new], section[:new, new:], section[new:, :new], section[new:, new:]
        whole = np.block(
            [
                [whole[:old, :old], np.zeros((old, new)), whole[:old, old:]],
                [B @ whole[old:, :old], A, B @ whole[old:, old:]],
                [D @ whole[old:, :old], C, D @ whole[old:, old:]],
            ]
        )
    return whole[:-1, :-1], whole[-1:, :-1]


def _section(part: Array) -> Array:
    """Orthogonal [A B; C D] with this characteristic polynomial of A: rotations by its reflection coefficients."""
    if len(part) == 2:
        return _rotation(part[1])
    k1, k2 = part[1] / (1.0 + part[2]), part[2]
    return np.asarray(linalg.block_diag(_rotation(k1), np.eye(1)) @ linalg.block_diag(np.eye(1), _rotation(k2)))


def _rotation(k: float) -> Array:
    s = np.sqrt((1.0 - k) * (1.0 + k))
    return np.array([[-k, s], [s, k]])


def weights(axis: Axis, observer: Any) -> Weights | None:
    """For which the observer is optimal, at gamma 1; None where T_f has a zero outside the unit circle, so that W_d
    would be unstable."""
    A, B, C, D = observer.A, observer.B[:, :1], observer.C, observer.D[:, :1]
    angles = np.linspace(0.0, np.pi, 4000)
    heard = np.abs(D + C @ np.linalg.solve(np.exp(1j * angles)[:, None, None] * np.eye(len(A)) - A, B.astype(complex)))
    c = NOISE_SHARE / float(np.max(heard))
    # The spectral factor q / a of 1 - c^2 |F M|^2, by the Riccati equation of the bounded real lemma.
    R = c**2 * D.T @ D - 1.0
    X = linalg.solve_discrete_are(A, B, c**2 * C.T @ C, R, s=c**2 * C.T @ D)
    size = R + B.T @ X @ B
    K = np.linalg.solve(size, B.T @ X @ A + c**2 * D.T @ C)
    zeros = np.linalg.eigvals(A - B @ K)
    poles = left_zeros(observer, axis.delay)
    if np.max(np.abs(poles)) >= 1.0:
        return None
    gain = float(np.sqrt(-size[0, 0]))
    return Weights(Zpk(_roots(np.concatenate([zeros, np.zeros(axis.delay)])), _roots(poles), gain), Zpk((), (), c))


def left_zeros(observer: Any, delay: int) -> Complex:
    """Zeros of T_f = 1 + z^-τ D_u of an observer: poles of the loop that it closes."""
    A, B, C = observer.A, observer.B[:, 1:], observer.C
    if delay == 0:
        return np.asarray(np.linalg.eigvals(A - B @ C))
    line = delay_line(delay)
    late = np.block([[A, -B @ line.C], [line.B @ C, line.A]])
    return np.asarray(np.linalg.eigvals(late))


def _roots(values: Complex) -> tuple[complex, ...]:
    """Real roots as real, pairs exactly conjugate, in one order."""
    real = sorted(float(v.real) for v in values if v.imag == 0.0)
    upper = sorted((complex(v) for v in values if v.imag > 0.0), key=lambda v: (v.real, v.imag))
    return (*map(complex, real), *(w for v in upper for w in (v, v.conjugate())))

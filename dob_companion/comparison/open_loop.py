"""The open-loop H-infinity design: reference [10] of the paper.

H. T. Seo, K.-S. Kim, S. Kim, "Generalized design of disturbance observer for non-minimum phase system using an
H-infinity approach", Int. Conf. Control, Automation and Systems, 2013. As the paper describes it: the H-infinity norm
from the disturbance to its estimation error is minimized on the open loop, without baseline feedback and without a
channel for measurement noise. It solves an LMI; the same optimum is computed here exactly.

With G = N / M the error left is E = 1 - z^-τ F N, F stable, and || W E ||∞ is to be least. E must be 1 at the plant's
zeros outside the unit circle, and up to order z^-(τ+r) at infinity (r the relative degree); nothing else binds it. So
W E is the all-pass of least size that interpolates W at these n nodes (D. Sarason, "Generalized interpolation in H∞",
Trans. AMS 127, 1967): γ a(λ) / a~(λ), λ = 1/z, a~ the reversed a, with γ a = W(T) a~ modulo the nodes' polynomial, T
its companion matrix. That is an eigenvalue problem of size n, and the largest |γ| is the optimum.

Without a noise channel the optimum answers noise with anything (+66 dB on the paper's pitch axis), so the usual remedy
is offered with it: a Butterworth low-pass behind d_hat, which the design does not know of.

How d_hat is split between y_n and u_e is left open on the open loop. Here D_u = -z^τ (1 - E) and D_y = -D_u / G, which
is deaf to commands: the fairest to the method, since the baseline loop then stays stable.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.comparison.rational import (
    ON_CIRCLE,
    NotApplicableError,
    Roots,
    leading_gain,
    observer_from,
    polynomial,
    power,
    product,
    reversed_in_z,
    roots_of,
)

Array = NDArray[np.float64]


def open_loop_hinf(plant: Any, delay: int, weight: tuple[Array, Array]) -> Any:
    """D(z) that minimizes || W E ||∞; weight = (num, den) of W(z), descending, zeros inside the unit circle.

    Raises NotApplicableError for plant zeros on the unit circle.
    """
    g, (w_num, w_den) = roots_of(plant), weight
    gamma, a = optimal_all_pass(g, delay, weight)
    below = product(w_num, reversed_in_z(a))
    above = gamma * product(a, w_den)  # E = above / below
    longest = max(len(above), len(below))
    estimate = _padded(below, longest) - _padded(above, longest)  # of 1 - E
    left = estimate[longest - len(below) + delay + g.relative_degree :]  # what stands before is 0
    shared = np.asarray(np.polydiv(left, polynomial(g.outer))[0], dtype=float)  # without remainder
    ahead = power(delay)
    return observer_from(
        product(shared, ahead, polynomial(g.poles)) / g.gain,
        -product(shared, ahead, polynomial(g.outer), polynomial(g.inner)),
        product(below, polynomial(g.inner)),
        float(plant.dt),
    )


def optimal_all_pass(g: Roots, delay: int, weight: tuple[Array, Array]) -> tuple[float, Array]:
    """(gamma, a): W E = gamma a(z) / reversed a(z), a in descending powers of z. |gamma| is the optimal norm."""
    if np.any(np.abs(g.outer) <= 1.0 + ON_CIRCLE):
        raise NotApplicableError("the open-loop design needs a plant without zeros on the unit circle")
    at_infinity = delay + g.relative_degree + len(weight[1]) - len(weight[0])  # W's own zeros there count
    nodes = np.concatenate([np.zeros(at_infinity), 1.0 / g.outer])
    n = len(nodes)
    T = np.eye(n, k=-1)
    T[:, -1] = -polynomial(nodes)[:0:-1]
    w_num, w_den = (_padded(w, max(map(len, weight))) for w in weight)
    W = np.linalg.solve(_at(w_den, T), _at(w_num, T))
    sizes, vectors = np.linalg.eig(W[:, ::-1])
    best = int(np.argmax(np.abs(sizes)))
    return float(np.real(sizes[best])), np.real(vectors[:, best])


def polynomials(weight: Any) -> tuple[Array, Array]:
    """(num, den) of a weight. Raises NotApplicableError unless it is SISO with its zeros inside the unit circle."""
    if weight.D.shape != (1, 1):
        raise NotApplicableError("the open-loop design needs a W_d of one input")
    zeros, poles = np.asarray(weight.zeros(), dtype=complex), np.asarray(weight.poles(), dtype=complex)
    if np.any(np.abs(zeros) >= 1.0 - ON_CIRCLE):
        raise NotApplicableError("the open-loop design needs a W_d whose zeros lie inside the unit circle")
    return polynomial(zeros, leading_gain(weight, len(poles) - len(zeros))), polynomial(poles)


def _at(p: Array, T: Array) -> Array:
    """z^-deg p evaluated at z^-1 = T: p's coefficients, ascending in 1/z."""
    out = np.zeros_like(T)
    for coefficient in p[::-1]:
        out = out @ T + coefficient * np.eye(len(T))
    return out


def _padded(p: Array, length: int) -> Array:
    return np.concatenate([np.zeros(length - len(p)), p])

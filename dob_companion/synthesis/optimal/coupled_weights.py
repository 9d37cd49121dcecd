"""The weights for which an observer of coupled axes is H-infinity optimal, in closed form.

As for one axis (`realization.weights`): W_n = c, and with X = D_y, Q Q* = I - c^2 X X* (spectral factor, stable with
its inverse) and W_d = T_f^-1 Q, for one link delay of all moments,

    T_f W_d (T_f W_d)* + c^2 X X* = I        at every frequency.

Q has the output matrix and the poles of the observer, which are zeros of T_f^-1: with the observer (A, [K H], C, [k 0])

    e = Q0 w - C ζ,  ζ+ = A ζ + H z^-τ e - B_Q w        W_d: w -> e, order of A and τ for each moment.
"""

from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.lti.response import response, spectral_radius
from dob_companion.lti.statespace import beside, delay_line
from dob_companion.synthesis.optimal.realization import NOISE_SHARE

Array = NDArray[np.float64]


def coupled_weights(observer: Any, rates: int, delay: int) -> tuple[Any, Any] | None:
    """(W_d, W_n) of an observer with inputs [y_n; u_e], y_n of `rates` channels; None where W_d would be unstable."""
    A, C, dt = observer.A, observer.C, observer.dt
    K, H, k = observer.B[:, :rates], observer.B[:, rates:], observer.D[:, :rates]
    heard = np.linalg.norm(response(ct.ss(A, K, C, k, dt), np.linspace(0.0, np.pi, 2000)), 2, axis=(1, 2))
    c = NOISE_SHARE / float(np.max(heard))
    Q0, B_Q = _factor(A, c * K, C, c * k)
    m, line = len(C), beside(*[delay_line(delay)] * len(C))
    # e = Q0 w - C ζ; the line's input is e and its output drives ζ through H.
    late = line.D  # the identity without delay
    top = np.hstack([A - H @ late @ C, H @ line.C])
    bottom = np.hstack([-line.B @ C, line.A])
    W_d = ct.ss(
        np.vstack([top, bottom]),
        np.vstack([H @ late @ Q0 - B_Q, line.B @ Q0]),
        np.hstack([-C, np.zeros((m, len(line.A)))]),
        Q0,
        dt,
    )
    if spectral_radius(W_d.A) >= 1.0:
        return None
    return W_d, ct.ss([], [], [], c * np.eye(rates), dt)


def _factor(A: Array, K: Array, C: Array, k: Array) -> tuple[Array, Array]:
    """Q0 and B_Q of Q = Q0 + C (zI - A)^-1 B_Q, Q Q* = I - X X*, X = k + C (zI - A)^-1 K of norm below 1.

    The Riccati equation of the bounded real lemma, for the dual system.
    """
    R = k @ k.T - np.eye(len(C))
    Y = linalg.solve_discrete_are(A.T, C.T, K @ K.T, R, s=K @ k.T)
    size = -(R + C @ Y @ C.T)
    gain = -(A @ Y @ C.T + K @ k.T)
    Q0 = np.linalg.cholesky(size)
    return np.asarray(Q0, dtype=np.float64), np.asarray(linalg.solve_triangular(Q0, gain.T, lower=True).T)

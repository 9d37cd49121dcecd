"""An independent answer to the same problem: SLICOT's continuous SB10AD on the bilinear-mapped generalized plant.

Estimation form with a stable static baseline gain and a command channel of weight 1, as the design theory
allows: gamma_star depends on neither. Nothing of the package's own solvers is used.
"""

import control as ct
import numpy as np
from scipy import linalg


def generalized_plant(plant, controller_gain, W_d, W_n, delays, command_weight=1.0):
    """(w_d, w_n, w_r, d_hat) -> (d' - d_hat, y_n, u_e) with u = -gain y_n + w_r; discrete, plain block algebra."""
    p, m = plant.D.shape
    n_p, n_d, n_n, n_t = plant.nstates, W_d.nstates, W_n.nstates, sum(delays)
    # Chain of delays: input d', output d.
    A_t, B_t, C_t, D_t = np.zeros((n_t, n_t)), np.zeros((n_t, m)), np.zeros((m, n_t)), np.zeros((m, m))
    first = 0
    for i, length in enumerate(delays):
        if length == 0:
            D_t[i, i] = 1.0
            continue
        B_t[first, i], C_t[i, first + length - 1] = 1.0, 1.0
        for k in range(1, length):
            A_t[first + k, first + k - 1] = 1.0
        first += length
    q_d, q_n = W_d.D.shape[1], W_n.D.shape[1]
    A = linalg.block_diag(plant.A, A_t, W_d.A, W_n.A)
    P, T, X, N = (slice(a, a + k) for a, k in zip(np.cumsum([0, n_p, n_t, n_d]), (n_p, n_t, n_d, n_n), strict=True))
    rows = len(A)
    d = np.zeros((m, rows))
    d[:, T], d[:, X] = C_t, D_t @ W_d.C
    B = np.zeros((rows, q_d + q_n))
    B[X, :q_d], B[N, q_d:], B[T, :q_d] = W_d.B, W_n.B, B_t @ W_d.D
    A[T, X] = B_t @ W_d.C
    d_direct = np.hstack([D_t @ W_d.D, np.zeros((m, q_n))])
    A[P] += plant.B @ d
    B[P] += plant.B @ d_direct
    Cy = np.zeros((p, rows))
    Cy[:, P], Cy[:, N] = plant.C, W_n.C
    Dy = np.hstack([np.zeros((p, q_d)), W_n.D])
    assert not np.any(plant.D), "the oracle is for strictly proper plants"
    K = controller_gain * np.eye(m, p)
    A[P] += plant.B @ (-K @ Cy)
    B[P] += plant.B @ (-K @ Dy)
    w_r = np.zeros((rows, m))
    w_r[P] = plant.B * command_weight
    z = np.zeros((m, rows))
    z[:, X] = W_d.C
    C = np.vstack([z, Cy, -K @ Cy])
    D = np.block(
        [
            [np.hstack([W_d.D, np.zeros((m, q_n))]), np.zeros((m, m)), -np.eye(m)],
            [Dy, np.zeros((p, m)), np.zeros((p, m))],
            [-K @ Dy, command_weight * np.eye(m), np.zeros((m, m))],
        ]
    )
    return ct.ss(A, np.hstack([B, w_r, np.zeros((rows, m))]), C, D, plant.dt)


def gamma_star(plant, controller_gain, W_d, W_n, delays):
    """The optimum that SB10AD reports after bisection."""
    P = generalized_plant(plant, controller_gain, W_d, W_n, delays)
    p, m = plant.D.shape
    return ct.hinfsyn(to_continuous(P), p + m, m)[2]


def to_continuous(system):
    """z = (1+s)/(1-s), which keeps the H-infinity norm."""
    n = system.nstates
    inverse = np.linalg.inv(system.A + np.eye(n))
    return ct.ss(
        inverse @ (system.A - np.eye(n)),
        np.sqrt(2.0) * inverse @ system.B,
        np.sqrt(2.0) * system.C @ inverse,
        system.D - system.C @ inverse @ system.B,
    )

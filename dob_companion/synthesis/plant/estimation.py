"""The generalized plant of the observer problem, in estimation form.

The paper closes d_hat around the baseline loop (its Fig. 3, eqs. 6-9). With an exact model the command
and the controller then cancel out of d -> d - z^-tau d_hat, provided the observer is command invariant
(D_y G + D_u = 0). Here that is not hoped for but built in: the observer is an estimator driven by the
innovation y_n - y_predicted, with the known input u_e fed to its model, so neither C nor the command
appears and D_u(inf) = 0.
"""

from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.lti import statespace
from dob_companion.lti.statespace import beside, diagonal

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class EstimationProblem:
    """Estimate z(k) = d(k + tau) from y_n(0…k) and u_e(0…k-1)::

                                    ┌──────────────────────────► z = d'   (to be estimated)
        w_d ──► W_d ──► (advanced) ─┴─► z^-tau ─► d ─►(+)─► G ─► y ─►(+)─► y_n
                                            u_e ──────►┘     w_n ─► W_n ─┘

        xi+ = A xi + B_u u_e + B w          w = [w_d; w_n]       (q)
        y_n = C xi + D_u u_e + D21 w        measurement          (p)
        z   = C1 xi          + D11 w        to be estimated      (m)

    xi = [plant; W_d and delay line; W_n], order n_G + n_Wd + n_Wn + tau per axis. d' is the disturbance
    tau samples ahead (per axis), because the correction -d_hat acts tau samples late.

    The observer that gains (K, K_z) define::

        xi_hat+ = A xi_hat + B_u u_e + K e      e = y_n - C xi_hat - D_u u_e
        d_hat   = C1 xi_hat          + K_z e    K_z D_u = 0, so that D has no direct path from u_e

    Shapes: A (n, n), B_u (n, m), B (n, q), C (p, n), D_u (p, m), D21 (p, q), C1 (m, n), D11 (m, q).
    """

    A: Array
    B_u: Array
    B: Array
    C: Array
    D_u: Array
    D21: Array
    C1: Array
    D11: Array
    dt: float

    @property
    def direct(self) -> Array:
        """Orthonormal N (p, r): the combinations N' y_n without feedthrough from u_e, so K_z = (.) N'."""
        if not np.any(self.D_u):
            return np.eye(len(self.C))
        return np.asarray(linalg.null_space(self.D_u.T))

    def observer(self, K: Array, K_z: Array) -> Any:
        """D(z) with inputs [y_n; u_e] and output d_hat; the columns of D for u_e are exactly zero."""
        m = self.D_u.shape[1]
        return ct.ss(
            self.A - K @ self.C,
            np.hstack([K, self.B_u - K @ self.D_u]),
            self.C1 - K_z @ self.C,
            np.hstack([K_z, np.zeros((len(self.C1), m))]),
            self.dt,
        )

    def error_system(self, K: Array, K_z: Array) -> Any:
        """w -> z - d_hat, which is all that the norm is about."""
        return ct.ss(
            self.A - K @ self.C, self.B - K @ self.D21, self.C1 - K_z @ self.C, self.D11 - K_z @ self.D21, self.dt
        )

    def transformed(self, T: Array, measure: Array) -> "EstimationProblem":
        """The problem in coordinates xi = T xi', y' = measure y_n."""
        Ti = np.linalg.inv(T)
        return EstimationProblem(
            A=Ti @ self.A @ T,
            B_u=Ti @ self.B_u,
            B=Ti @ self.B,
            C=measure @ self.C @ T,
            D_u=measure @ self.D_u,
            D21=measure @ self.D21,
            C1=self.C1 @ T,
            D11=self.D11,
            dt=self.dt,
        )


def estimation_problem(plant: Any, W_d: Any, W_n: Any, delays: tuple[int, ...]) -> EstimationProblem:
    """Assemble the problem from discrete systems: plant G (p, m), weights (m, .) and (p, .), delays per input.

    Raises ValueError when sizes do not fit.
    """
    p, m = plant.D.shape
    if W_d.D.shape[0] != m or W_n.D.shape[0] != p or len(delays) != m:
        raise ValueError(
            f"plant is {p}x{m}: expected W_d with {m} outputs, W_n with {p} and {m} delays, "
            f"got {W_d.D.shape[0]}, {W_n.D.shape[0]} and {len(delays)}"
        )
    # A coupled W_d mixes axes of different delay, so all are advanced by the longest one.
    leads = delays if _is_decoupled(W_d) else (max(delays),) * m
    ahead = tuple(lead - delay for lead, delay in zip(leads, delays, strict=True))
    source = delay_line(leads, ahead, plant.dt) * W_d
    q, (n_p, n_s, n_n) = W_n.D.shape[1], (plant.nstates, source.nstates, W_n.nstates)
    C_d, C_z, D_d, D_z = source.C[:m], source.C[m:], source.D[:m], source.D[m:]
    A = linalg.block_diag(plant.A, source.A, W_n.A)
    A[:n_p, n_p : n_p + n_s] = plant.B @ C_d
    return EstimationProblem(
        A=A,
        B_u=np.vstack([plant.B, np.zeros((n_s + n_n, m))]),
        B=np.block(
            [
                [plant.B @ D_d, np.zeros((n_p, q))],
                [source.B, np.zeros((n_s, q))],
                [np.zeros((n_n, D_d.shape[1])), W_n.B],
            ]
        ),
        C=np.hstack([plant.C, plant.D @ C_d, W_n.C]),
        D_u=np.array(plant.D, dtype=float),
        D21=np.hstack([plant.D @ D_d, W_n.D]),
        C1=np.hstack([np.zeros((m, n_p)), C_z, np.zeros((m, n_n))]),
        D11=np.hstack([D_z, np.zeros((m, q))]),
        dt=plant.dt,
    )


def delay_line(lengths: tuple[int, ...], taps: tuple[int, ...], dt: float) -> Any:
    """Inputs delayed by `lengths`, then the same inputs delayed by `taps` (each tap <= its length)."""
    line = beside(*map(statespace.delay_line, lengths))
    tapped = diagonal(*(np.eye(1, length, k=tap - 1) * (tap > 0) for length, tap in zip(lengths, taps, strict=True)))
    direct = np.diag([float(tap == 0) for tap in taps])
    return ct.ss(line.A, line.B, np.vstack([line.C, tapped]), np.vstack([line.D, direct]), dt)


def delay(lengths: tuple[int, ...], dt: float) -> Any:
    """diag(z^-length), one channel each."""
    return ct.ss(*beside(*map(statespace.delay_line, lengths)), dt)


def _is_decoupled(W: Any) -> bool:
    """Whether output i depends on input i alone, seen from impulse responses."""
    p, q = W.D.shape
    if p != q:
        return False
    mixed = ~np.eye(p, dtype=bool)
    reach = W.B
    markov = [W.D]
    for _ in range(2 * W.nstates):
        markov.append(W.C @ reach)
        reach = W.A @ reach
    return not any(np.any(h[mixed] != 0.0) for h in markov)

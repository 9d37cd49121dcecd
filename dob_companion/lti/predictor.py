"""What a design expects of the next gyro samples: its plant, disturbance and noise as one Kalman predictor."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dob_companion.lti.gramian import predictor
from dob_companion.lti.statespace import System

Array = NDArray[np.float64]


class Weighted(Protocol):
    """y_n = G (u_e + W_d w_d) + W_n w_n with w_d, w_n white of unit covariance."""

    @property
    def plant(self) -> System: ...  # noqa: D102
    @property
    def disturbance_weight(self) -> System: ...  # noqa: D102
    @property
    def noise_weight(self) -> System: ...  # noqa: D102


@dataclass(frozen=True, slots=True, eq=False)
class Predictor:
    """x+ = A x + B u_e + B_w w, y_n = C x + D u_e + D_w w; x_hat+ = A x_hat + B u_e + K (y_n - C x_hat - D u_e).

    P is the steady covariance of x - x_hat before y_n is known. p rates, m moments, n states: A (n, n), B (n, m),
    B_w (n, w), C (p, n), D (p, m), D_w (p, w), K (n, p).
    """

    A: Array
    B: Array
    B_w: Array
    C: Array
    D: Array
    D_w: Array
    K: Array
    P: Array

    @classmethod
    def of(cls, problem: Weighted, noise_scale: float = 1.0) -> "Predictor":
        """The predictor of a design's problem, its noise weight times `noise_scale`: the smaller that is, the stronger
        the disturbance that it reckons with. Raises NotConvergedError when its Riccati equation has no rest."""
        plant, w_d, w_n = problem.plant, problem.disturbance_weight, problem.noise_weight
        n, d, v, k = len(plant.A), len(w_d.A), len(w_n.A), w_d.D.shape[1]
        A = np.zeros((n + d + v, n + d + v))
        A[:n, :n], A[:n, n : n + d] = plant.A, plant.B @ w_d.C
        A[n : n + d, n : n + d], A[n + d :, n + d :] = w_d.A, w_n.A
        B_w = np.zeros((n + d + v, k + w_n.D.shape[1]))
        B_w[:n, :k], B_w[n : n + d, :k], B_w[n + d :, k:] = plant.B @ w_d.D, w_d.B, w_n.B
        C = np.hstack([plant.C, plant.D @ w_d.C, noise_scale * w_n.C])
        D_w = np.hstack([plant.D @ w_d.D, noise_scale * w_n.D])
        B: Any = np.vstack([plant.B, np.zeros((d + v, plant.B.shape[1]))])
        K, P = predictor(A, C, B_w, D_w)
        return cls(A, B, B_w, C, np.asarray(plant.D), D_w, K, P)

    def shaping(self, angle: float) -> Array:
        """From innovation to rates, I + C (zI - A)^-1 K at z = e^(j angle): gain (p,) of each rate's own, angle in rad
        per sample."""
        z = np.exp(1j * angle)
        own = np.eye(len(self.C)) + self.C @ np.linalg.solve(z * np.eye(len(self.A)) - self.A, self.K)
        return np.abs(np.diag(own))

    def bridging(self, longest: int) -> list[Array]:
        """How much of the surprise at the sample after a silence belongs to each one before it, for each length.

        Without gyro samples the rates are foreseen as r_1, r_2, …; when the one at M then comes and is off by e, the
        best that can be said of sample i is r_i + W_i e with W_i = cov(y_i, y_M) cov(y_M)^-1 (conditional expectation
        of a Gaussian; that of a fixed-interval smoother, Anderson and Moore, "Optimal Filtering", 1979, chapter 7).
        Returns for M = 0 … `longest` the weights W_1 … W_M, shape (M, p, p); W_M is the identity.
        """
        p, noise = len(self.C), self.D_w @ self.D_w.T
        P, reach, found = self.P, self.C, [np.zeros((0, p, p))]
        reaches: list[Array] = []  # C A^k
        onward: list[Array] = []  # cov(x_(i+1), y_i)
        for steps in range(1, longest + 1):
            inverse = np.linalg.inv(self.C @ P @ self.C.T + noise)
            weights = np.empty((steps, p, p))
            if steps > 1:
                cross = np.matmul(np.array(reaches[::-1]), np.array(onward))  # cov(y_steps, y_i), i = 1 … steps - 1
                weights[:-1] = np.matmul(cross.transpose(0, 2, 1), inverse)
            weights[-1] = np.eye(p)
            found.append(weights)
            onward.append(self.A @ P @ self.C.T + self.B_w @ self.D_w.T)
            reaches.append(reach)
            reach, P = reach @ self.A, self.A @ P @ self.A.T + self.B_w @ self.B_w.T
        return found

"""The least attitude error at a price: LQG that must also keep a disk margin and keep gyro noise out of the correction.

Command-invariant observers are d_hat = F (M y_n - N u_e), G = N / M and F any stable filter. On the exact model then

    T_f = 1 - z^-τ F N                   d -> d - z^-τ d_hat
    θ   = F_d T_f d + (F_n - F_d z^-τ F M) n
    d_hat from n: F M,   disk margin: 1 / max |S T_f - 1/2|

All of it is affine in F, so the least attitude error under bounds on the others is one convex problem (S. Boyd,
C. Barratt, "Linear Controller Design: Limits of Performance", 1991, chapters 8 and 15): here a second-order cone
programme over F's first samples and a few slow poles. F is of high order and nothing flies it; it says what is to be
had. A finite F and a frequency grid leave less than 1 % to be had beyond it (tests).
"""

from typing import Any

import control as ct
import cvxpy
import numpy as np
from numpy.typing import NDArray

from dob_companion.comparison.flight import NOISE_SIGMA, disturbance_pole
from dob_companion.comparison.lqg import coprime
from dob_companion.comparison.rational import polynomial, product, roots_of
from dob_companion.comparison.vehicle import OUTPUTS, Vehicle, close, no_observer
from dob_companion.lti.response import response

cp: Any = cvxpy  # its own annotations are partial

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

TAPS = 60
SLOW_S = (0.04, 0.13, 0.4, 1.3)
"""F is free in its first TAPS samples and in these time constants."""

POINTS, EVERY = 1200, 3
"""Frequencies over which variances are summed, and the share of them at which the margin is asked for."""


class AtPrice:
    """One vehicle in one weather (sigma of the disturbance, normalized torque), ready to be asked for its best."""

    def __init__(self, vehicle: Vehicle, scale: float, taps: int = TAPS) -> None:
        """Raise ValueError when the plant has a direct term; the loop must be stable without observer."""
        half = POINTS // 2
        angles = np.unique(np.concatenate([np.geomspace(1e-5, np.pi, half), np.linspace(1e-3, np.pi, half)]))
        z, a = np.exp(1j * angles), disturbance_pole(vehicle.dt)
        share = np.sqrt(np.gradient(angles) / np.pi)  # of the variance at each angle
        off = response(
            close(Vehicle(vehicle.plant, vehicle.controller, 0, vehicle.attitude_gain), no_observer(vehicle.dt)), angles
        )
        M, N = coprime(vehicle.plant, angles)
        self._vehicle, self._taps, self._unit = vehicle, taps, abs(N[0])
        M, N = M / self._unit, N / self._unit
        self._slow = slow = np.exp(-vehicle.dt / np.array(SLOW_S))
        F = np.hstack([z[:, None] ** -np.arange(taps), (1.0 - slow) / (1.0 - slow / z[:, None])])
        late = z**-vehicle.delay
        wind = share * scale * np.sqrt(1.0 - a * a) / (z - a)
        hiss = share * NOISE_SIGMA
        d, n = (off[:, OUTPUTS.index("theta"), i] for i in (0, 1))
        self._theta = _split(np.vstack([-(wind * d * late * N)[:, None] * F, -(hiss * d * late * M)[:, None] * F]))
        self._theta_off = _split(np.concatenate([wind * d, hiss * n]))
        self._noise = _split((hiss * M)[:, None] * F)
        S = 1.0 / (1.0 + response(vehicle.plant, angles)[:, 0, 0] * response(vehicle.controller, angles)[:, 0, 0])
        self._disk, self._disk_off = -(S * late * N)[:, None] * F, S - 0.5

    def best(self, disk_margin: float | None = None, noise: float | None = None) -> Any:
        """D(z) of the least attitude error with at least this disk margin and at most this noise; None sets no bound.

        `noise` is the RMS of the correction that gyro noise alone causes, normalized torque. Raises ValueError when
        there is nothing within the bounds.
        """
        size = float(np.linalg.norm(self._theta_off))
        x = cp.Variable(self._theta.shape[1])
        T = _triangle(np.column_stack([self._theta, self._theta_off]) / size)
        bounds = []
        if disk_margin is not None:
            at = slice(None, None, EVERY)
            H, h = self._disk[at], self._disk_off[at]
            parts = cp.vstack([H.real @ x + h.real, H.imag @ x + h.imag])
            bounds.append(cp.norm(parts, 2, axis=0) <= 1.0 / disk_margin)
        if noise is not None:
            bounds.append(cp.norm(_triangle(self._noise / noise) @ x) <= 1.0)
        problem = cp.Problem(cp.Minimize(cp.norm(T[:, :-1] @ x + T[:, -1])), bounds)
        problem.solve(solver=cp.CLARABEL)
        if x.value is None:
            raise ValueError(f"no observer has disk margin {disk_margin} and noise {noise}: {problem.status}")
        return self._observer(np.asarray(x.value))

    def _observer(self, F: Array) -> Any:
        """D(z) = F [M, -N], M and N as delay lines."""
        dt, taps, g = self._vehicle.dt, self._taps, roots_of(self._vehicle.plant)
        M, N = polynomial(g.poles), product(polynomial(g.inner, g.gain), polynomial(g.outer))
        N = np.concatenate([np.zeros(len(M) - len(N)), N])
        seen = np.stack([M, -N], axis=1) / self._unit
        n = len(M) - 1
        first = ct.ss(np.eye(2 * n, k=-2), np.eye(2 * n, 2), seen[1:].reshape(1, -1), seen[:1], dt)
        line = ct.ss(np.eye(taps - 1, k=-1), np.eye(taps - 1, 1), F[None, 1:taps], [[F[0]]], dt)
        share = F[taps:] * (1.0 - self._slow)
        modes = ct.ss(np.diag(self._slow), np.ones((len(share), 1)), [share * self._slow], [[np.sum(share)]], dt)
        return (line + modes) * first


def _split(values: Complex) -> Array:
    return np.asarray(np.concatenate([values.real, values.imag]))


def _triangle(matrix: Array) -> Array:
    """R of A = Q R: the same norms from far fewer rows."""
    return np.asarray(np.linalg.qr(matrix, mode="r"))

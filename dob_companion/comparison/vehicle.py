"""The vehicle that every observer flies, and the loop around it, closed once for all of them.

::

             r = -k θ      u            u_e  (reported)                 d
    θ ──────────────►(-)─► C ─►(-)───────┬──────────►(-)' ─► (+) ─► G ─►┬─► y ─► ∫ ─► θ
                      ▲         ▲        ▼                              │
                      │  y_n    └─ z^-τ ◄─ d_hat ◄─ D(z) ◄─ [y_n; u_e]  │
                      └──────────────────────(+)◄───────────────────────┘
                                              ▲ n

u_e = u - z^-τ d_hat is the moment as applied and reported. Further delay that the vehicle does report adds to τ;
delay that it does not know of sits at (-)' and is what delay margins are about (docs/interfaces.md, design.json).
"""

from dataclasses import dataclass, replace
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ATTITUDE_GAIN = 6.5
"""Rate asked for per attitude error, 1/s: the simulated vehicle's, a usual multirotor value."""

INPUTS = ("d", "n")
OUTPUTS = ("y", "u_e", "d_hat", "error", "theta")
"""error is d - z^-τ d_hat; theta the attitude error in rad."""


@dataclass(frozen=True, slots=True, eq=False)
class Vehicle:
    """One axis: discrete SISO systems of one dt (s), link delay in samples, attitude gain in 1/s.

    plant from moment (normalized torque) to rate (rad/s), strictly proper; controller +C of u = C (r - y_n).
    """

    plant: Any
    controller: Any
    delay: int
    attitude_gain: float = ATTITUDE_GAIN

    @property
    def dt(self) -> float:
        """Sample time in s."""
        return float(self.plant.dt)

    def with_gain(self, factor: float) -> "Vehicle":
        """The same vehicle whose plant answers `factor` times as strongly."""
        p = self.plant
        return replace(self, plant=ct.ss(p.A, p.B, factor * p.C, factor * p.D, p.dt))

    def with_delay(self, more: int) -> "Vehicle":
        """The same vehicle behind a link that takes `more` further samples, which it reports truly."""
        return replace(self, delay=self.delay + more)


def close(vehicle: Vehicle, observer: Any, *, attitude: bool = True, unseen: int = 0) -> Any:
    """The closed loop (d, n) -> OUTPUTS around an observer D(z): [y_n; u_e] -> d_hat.

    Without `attitude` the rate loop alone is closed (theta then is the free integral of y). `unseen` samples of
    delay act on the correction without showing in u_e. Raises ValueError when the plant has a direct term.
    """
    if np.any(vehicle.plant.D):
        raise ValueError("the plant answers at once; expected a strictly proper one")
    dt = vehicle.dt
    integral = (np.eye(1), np.array([[dt]]), np.eye(1), np.array([[dt / 2.0]]))  # trapezoidal: the rate's mean
    parts = [
        _matrices(vehicle.plant),
        _matrices(vehicle.controller),
        _matrices(observer),
        _delay(vehicle.delay),
        _delay(unseen),
        integral,
    ]
    A, B, C, D = (_side_by_side(matrices) for matrices in zip(*parts, strict=True))
    k = vehicle.attitude_gain if attitude else 0.0
    # Columns: y, u, d_hat, late, acting, theta; then d, n. Rows: the parts' inputs, y_n and u_e both D(z)'s.
    inside = np.array(
        [
            [0, 1, 0, 0, -1, 0],
            [-1, 0, 0, 0, 0, -k],
            [1, 0, 0, 0, 0, 0],
            [0, 1, 0, -1, 0, 0],
            [0, 0, 1, 0, 0, 0],
            [0, 0, 0, 1, 0, 0],
            [1, 0, 0, 0, 0, 0],
        ]
    )
    outside = np.array([[1, 0], [0, -1], [0, 1], [0, 0], [0, 0], [0, 0], [0, 0]], dtype=float)
    read = np.array(
        [[1, 0, 0, 0, 0, 0], [0, 1, 0, -1, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 0, -1, 0], [0, 0, 0, 0, 0, 1]]
    )
    beside = np.zeros((len(OUTPUTS), 2))
    beside[OUTPUTS.index("error"), 0] = 1.0
    solved = np.linalg.inv(np.eye(len(D)) - D @ inside)  # the parts' outputs, algebraic loop solved
    Cv, Dv = solved @ C, solved @ D @ outside
    return ct.ss(A + B @ inside @ Cv, B @ (outside + inside @ Dv), read @ Cv, read @ Dv + beside, dt)


STABLE = 1.0 - 1e-9
"""A spectral radius from here on counts as unstable: what rounding leaves of a mode on the unit circle."""


def spectral_radius(A: Array) -> float:
    """Largest magnitude of the eigenvalues."""
    return float(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0))


def covariance(A: Array, B: Array) -> Array:
    """P = A P A' + B B' for stable A, by doubling (Smith, SIAM J. Appl. Math. 16, 1968)."""
    P, power = B @ B.T, A
    for _ in range(60):
        step = power @ P @ power.T
        P = P + step
        if np.linalg.norm(step) <= 1e-16 * np.linalg.norm(P):
            break
        power = power @ power
    return np.asarray((P + P.T) / 2.0)


def no_observer(dt: float) -> Any:
    """D(z) = 0."""
    return ct.ss([], [], [], [[0.0, 0.0]], dt)


def _side_by_side(matrices: tuple[Array, ...]) -> Array:
    """Block-diagonal; scipy's spends more time on its arguments than a whole loop takes here."""
    out = np.zeros((sum(len(M) for M in matrices), sum(M.shape[1] for M in matrices)))
    row = column = 0
    for M in matrices:
        out[row : row + len(M), column : column + M.shape[1]] = M
        row, column = row + len(M), column + M.shape[1]
    return out


def _matrices(system: Any) -> tuple[Array, ...]:
    return system.A, system.B, system.C, system.D


def _delay(samples: int) -> tuple[Array, ...]:
    n = samples
    B, C = np.eye(n, 1), np.eye(1, n, k=max(n - 1, 0))
    return np.eye(n, k=-1), B, C, np.full((1, 1), float(n == 0))

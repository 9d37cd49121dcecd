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

from dob_companion.lti.statespace import ABCD, delay_line
from dob_companion.lti.wiring import connected

ATTITUDE_GAIN = 6.5
"""Rate asked for per attitude error, 1/s: the simulated vehicle's, a usual multirotor value."""

INPUTS = ("d", "n")
OUTPUTS = ("y", "u_e", "d_hat", "error", "theta")
"""error is d - z^-τ d_hat; theta the attitude error in rad."""

_INTO = {
    "moment": {"u": 1.0, "acting": -1.0, "d": 1.0},  # into G
    "measured": {"y": -1.0, "n": -1.0},  # into C, and -k θ with it
    "y_n": {"y": 1.0, "n": 1.0},  # into D(z), first
    "u_e": {"u": 1.0, "late": -1.0},  # into D(z), second
    "estimate": {"d_hat": 1.0},  # into z^-τ
    "believed": {"late": 1.0},  # into the delay that u_e does not show
    "rate": {"y": 1.0},  # into ∫
}
_GIVE = ("y", "u", "d_hat", "late", "acting", "theta")
_READ = {
    "y": {"y": 1.0},
    "u_e": _INTO["u_e"],
    "d_hat": {"d_hat": 1.0},
    "error": {"d": 1.0, "acting": -1.0},
    "theta": {"theta": 1.0},
}
_SIZE = dict.fromkeys((*_INTO, *_GIVE, *_READ, *INPUTS), 1)


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
    integral = ABCD(np.eye(1), np.array([[dt]]), np.eye(1), np.array([[dt / 2.0]]))  # trapezoidal: the rate's mean
    parts = (vehicle.plant, vehicle.controller, observer, *map(delay_line, (vehicle.delay, unseen)), integral)
    k = vehicle.attitude_gain if attitude else 0.0
    into = _INTO | {"measured": _INTO["measured"] | {"theta": -k}}
    whole = connected(parts, into=into, give=_GIVE, outside=INPUTS, read=_READ, size=_SIZE)
    return ct.ss(*whole, dt)


def no_observer(dt: float) -> Any:
    """D(z) = 0."""
    return ct.ss([], [], [], [[0.0, 0.0]], dt)

"""The data of one block: what the observer is designed for."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Discrete python-control systems of one dt; p rates, m moments.

    plant (p, m) from moment (u_e + d) to rate; controller (m, p), +C of u = C (r - y_n); weights with m and p
    outputs, shaping d and n; delays from d_hat to the acting moment in samples, one per plant input.
    """

    plant: Any
    controller: Any
    disturbance_weight: Any
    noise_weight: Any
    delays: tuple[int, ...]

    @property
    def dt(self) -> float:
        """Sample time in s."""
        return float(self.plant.dt)

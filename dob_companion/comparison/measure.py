"""What is measured of an observer, the same way for every one of them.

The loop broken at u_e (rate loop, attitude loop open) is, for the disk margin, that of one equivalent controller
K = (C + z^-τ D_y) / (1 + z^-τ D_u): S = 1 / (1 + K G), and the margin is 1 / max |S - 1/2| (P. Seiler, A. Packard,
P. Gahinet, "An introduction to disk margins", IEEE Control Systems 40(5), 2020, skew 0).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.comparison.vehicle import Vehicle, close
from dob_companion.lti import margins
from dob_companion.lti.response import response

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class LoopResponses:
    """Frequency responses of one vehicle's plant, controller and link, computed once for many observers."""

    def __init__(self, vehicle: Vehicle, count: int = 700) -> None:
        """Angles (rad per sample) are logarithmic and linear up to half the rate."""
        half = count // 2
        self.angles = np.unique(np.concatenate([np.geomspace(1e-3, np.pi, half), np.linspace(0.01, np.pi, half)]))
        self.vehicle = vehicle
        self.G = response(vehicle.plant, self.angles)[:, 0, 0]
        self.C = response(vehicle.controller, self.angles)[:, 0, 0]
        self.late = np.exp(-1j * self.angles * vehicle.delay)

    @property
    def hertz(self) -> Array:
        """The angles as frequencies."""
        return self.angles / (2.0 * np.pi * self.vehicle.dt)

    def disk_margin(self, observer: Any) -> float:
        """Largest disk of gain and phase error in the moment that the loop is sure to survive."""
        S, _ = self._sensitivity(observer)
        return margins.disk_margin(S)

    def error(self, observer: Any) -> Complex:
        """d -> d - z^-τ d_hat at the angles: T_f of the paper's Eq. (2), link delay included."""
        S, D = self._sensitivity(observer)
        # u_e = -K y and y = G S d, so d_hat = (D_y - D_u K) G S d with K G = 1 / S - 1.
        estimate = D[:, 0] * self.G * S - D[:, 1] * (1.0 - S)
        return np.asarray(1.0 - self.late * estimate)

    def noise_peak(self, observer: Any) -> float:
        """Largest gain n -> d_hat, normalized torque per rad/s."""
        S, D = self._sensitivity(observer)
        # y_n = S n and u_e = -K S n.
        return float(np.max(np.abs(D[:, 0] * S - D[:, 1] * (1.0 - S) / self.G)))

    def _sensitivity(self, observer: Any) -> tuple[Complex, Complex]:
        D = response(observer, self.angles)[:, 0, :]
        told = 1.0 + self.late * D[:, 1]
        return np.asarray(told / (told + self.G * (self.C + self.late * D[:, 0]))), D


def delay_margin(vehicle: Vehicle, observer: Any) -> int:
    """Further whole samples of delay, unknown to the observer, that leave the rate loop stable."""
    # theta integrates y outside the loop; its eigenvalue 1 is not the loop's
    return margins.delay_margin(lambda late: close(vehicle, observer, attitude=False, unseen=late).A[:-1, :-1])

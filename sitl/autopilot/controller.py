"""The baseline attitude controllers: PID (12) or matrices on body rates, and the quaternion attitude loop around."""

from typing import Protocol

import numpy as np

from sitl.airframe.state_space import StateSpace, beside
from sitl.attitude import ZERO, Vector
from sitl.autopilot.tuning import RateGains

ATTITUDE_GAIN = 6.5
"""Rate asked for per attitude error, 1/s. The paper does not print it; 6.5 is the gain its time-domain reference
values were computed with, a usual multirotor value (PX4's MC_PITCH_P and ArduPilot's ATC_ANG_PIT_P are 6.5 and 4.5)."""


class RateController:
    """One `RateGains` as the sum of its partial fractions, C(z) = p + i / (z − 1) + d / z, saturated at ±1.

    The integrator is kept within ±1, the torque there is, so it cannot wind up further; below saturation it is (12)
    exactly.
    """

    __slots__ = ("_d", "_i", "_integral", "_last", "_p")

    def __init__(self, gains: RateGains) -> None:
        z1, z2 = gains.zeros
        self._p = gains.gain
        self._i = gains.gain * (1.0 - z1) * (1.0 - z2)
        self._d = -gains.gain * z1 * z2
        self._integral = self._last = 0.0

    def step(self, error: float) -> float:
        """Torque for this rate error (r − y_n, rad/s); one call per sample."""
        u = self._p * error + self._d * self._last + self._integral
        self._last = error
        integral = self._integral + self._i * error
        self._integral = max(-1.0, min(1.0, integral))
        return max(-1.0, min(1.0, u))

    def reset(self) -> None:
        """Forget everything, as on the ground."""
        self._integral = self._last = 0.0


class RateLaw(Protocol):
    """The rate controllers of all three axes: rate errors (r − y_n, rad/s) to torque within ±1, once per sample."""

    def step(self, error: Vector) -> Vector:
        """Torque about roll, pitch, yaw."""
        ...

    def reset(self) -> None:
        """Forget everything, as on the ground."""
        ...


class Pids:
    """Three `RateController`, roll, pitch, yaw."""

    def __init__(self, gains: tuple[RateGains, RateGains, RateGains]) -> None:
        self._roll, self._pitch, self._yaw = (RateController(each) for each in gains)

    def step(self, error: Vector) -> Vector:
        """See `RateLaw.step`."""
        return self._roll.step(error[0]), self._pitch.step(error[1]), self._yaw.step(error[2])

    def reset(self) -> None:
        """See `RateLaw.reset`."""
        for axis in (self._roll, self._pitch, self._yaw):
            axis.reset()


class MatrixLaw:
    """u = C(z) (r − y_n) as matrices, one for each group of axes that belong together.

    Below saturation it is C(z) exactly. A controller of any order has no integrator that could be clamped by itself,
    so while an output is beyond ±1 and the error pushes it further out, the states of its group stand still.
    """

    def __init__(self, parts: list[tuple[tuple[int, ...], StateSpace]]) -> None:
        c = beside(parts)
        self._whole, self._n = np.block([[c.A, c.B], [c.C, c.D]]), len(c.A)
        ends = np.cumsum([0] + [len(part.A) for _, part in parts]).tolist()
        self._groups = [(axes, slice(*ends[k : k + 2])) for k, (axes, _) in enumerate(parts)]
        self._inputs = np.zeros(self._n + 3)

    def step(self, error: Vector) -> Vector:
        """See `RateLaw.step`."""
        n = self._n
        self._inputs[n:] = error
        ahead = self._whole @ self._inputs
        roll, pitch, yaw = u = ahead[n:].tolist()
        if min(u) >= -1.0 and max(u) <= 1.0:
            self._inputs[:n] = ahead[:n]
            return roll, pitch, yaw
        for axes, states in self._groups:
            if not any(abs(u[i]) > 1.0 and u[i] * error[i] > 0.0 for i in axes):
                self._inputs[states] = ahead[states]
        return max(-1.0, min(1.0, roll)), max(-1.0, min(1.0, pitch)), max(-1.0, min(1.0, yaw))

    def reset(self) -> None:
        """See `RateLaw.reset`."""
        self._inputs[:] = 0.0


def rate_setpoint(attitude_error: Vector, gain: Vector, ahead: Vector = ZERO) -> Vector:
    """Body rate, rad/s, that turns the attitude error back: −gain · e (paper, Fig. 4, the *Quaternion Linear* law).

    `gain` is that of each axis, 1/s; `ahead` the rate at which the attitude commanded turns, rad/s: fed forward, no
    error must ask for it.
    """
    e = attitude_error
    return (ahead[0] - gain[0] * e[0], ahead[1] - gain[1] * e[1], ahead[2] - gain[2] * e[2])

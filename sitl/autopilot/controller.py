"""The baseline attitude controllers: PID (12) on each body rate and the quaternion attitude loop around it."""

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


def rate_setpoint(attitude_error: Vector, gain: float = ATTITUDE_GAIN, ahead: Vector = ZERO) -> Vector:
    """Body rate, rad/s, that turns the attitude error back: −gain · e (paper, Fig. 4, the *Quaternion Linear* law).

    `ahead` is the rate at which the attitude commanded turns, rad/s: fed forward, no error must ask for it.
    """
    e = attitude_error
    return (ahead[0] - gain * e[0], ahead[1] - gain * e[1], ahead[2] - gain * e[2])

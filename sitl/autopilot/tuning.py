"""What the controllers must know about the airframe that they fly."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RateGains:
    """C(z) = gain · (z − zeros[0]) (z − zeros[1]) / (z (z − 1)): rate error, rad/s, to normalized torque."""

    gain: float
    zeros: tuple[float, float]

    def pid(self, dt: float) -> tuple[float, float, float]:
        """P, I (1/s) and D (s) of u = P e + I dt sum(e before) + D (e − e before) / dt, which is C(z)."""
        z1, z2 = self.zeros
        return self.gain * (1.0 - z1 * z2), self.gain * (1.0 - z1) * (1.0 - z2) / dt, self.gain * z1 * z2 * dt


@dataclass(frozen=True, slots=True)
class Tuning:
    """Rate controllers about roll, pitch, yaw; the normalized thrust that carries the weight.

    `altitude_integral` is the acceleration gained per climb rate error and time, 1/s²; `position_hold` says whether
    it can be blown away, so that somebody must bring it back.
    """

    rate: tuple[RateGains, RateGains, RateGains]
    hover_thrust: float
    altitude_integral: float = 0.0
    position_hold: bool = False


PITCH_PID = RateGains(gain=0.9002, zeros=(0.8343, 0.9987))
"""Paper, Eq. (12)."""

ROLL_PID = RateGains(gain=0.9, zeros=(0.9, 0.9993))
"""Roll turns the whole span, with a third of pitch's acceleration: crossover 5.4 Hz with 59° of phase margin, where
pitch has 14.2 Hz and 49°. Tuned on the model's linearization; the paper prints no roll controller."""

YAW_PID = RateGains(gain=0.27, zeros=(0.5, 0.9985))
"""Yaw has a tenth of pitch's acceleration, and the reaction of the rotors' inertia gives it lead, so it needs little
derivative: crossover 3 Hz. Tuned on the model's linearization; the paper prints no yaw controller."""

RATE_PIDS = (ROLL_PID, PITCH_PID, YAW_PID)

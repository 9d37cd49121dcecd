"""What the controllers must know about the airframe that they fly: rate gains per axis and the hover thrust."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RateGains:
    """C(z) = gain · (z − zeros[0]) (z − zeros[1]) / (z (z − 1)): rate error, rad/s, to normalized torque."""

    gain: float
    zeros: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Tuning:
    """Rate controllers about roll, pitch, yaw, and the normalized thrust that carries the weight."""

    rate: tuple[RateGains, RateGains, RateGains]
    hover_thrust: float


PITCH_PID = RateGains(gain=0.9002, zeros=(0.8343, 0.9987))
"""Paper, Eq. (12)."""

"""Rate controllers of the tail-sitter: the paper's on pitch, the same law slowed down where there is less torque."""

from sitl.tailsitter.parameters import Parameters
from sitl.tuning import PITCH_PID, RateGains

ROLL_SPEED, YAW_SPEED = 0.45, 0.35
"""Bandwidth of the roll and yaw rate loops over that of pitch."""


def rate_gains(p: Parameters) -> tuple[RateGains, RateGains, RateGains]:
    """Gains of roll, pitch and yaw."""
    ix, iy, iz = p.inertia
    lift = abs(p.axis_z)
    pitch = lift * p.rotor_x[0] / iy
    roll = lift * p.rotor_y[0] / ix
    yaw = (lift * p.torque_arm - p.rotor_y[0] * p.axis_x[0]) / iz
    return _slowed(ROLL_SPEED, pitch / roll), PITCH_PID, _slowed(YAW_SPEED, pitch / yaw)


def _slowed(speed: float, weakness: float) -> RateGains:
    """(12) with loop gain and slow zero at `speed` times pitch's, on a plant weaker by `weakness`."""
    fast, slow = PITCH_PID.zeros
    return RateGains(PITCH_PID.gain * speed * weakness, (fast, 1.0 - (1.0 - slow) * speed))

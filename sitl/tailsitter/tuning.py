"""Rate controllers of the tail-sitter: the paper's on pitch, and gains of their own for the weaker axes."""

from sitl.tuning import PITCH_PID, RateGains

ROLL_PID = RateGains(gain=0.9, zeros=(0.9, 0.9993))
"""Roll turns the whole span, with a third of pitch's acceleration: crossover 5.4 Hz with 59° of phase margin, where
pitch has 14.2 Hz and 49°. Tuned on the model's linearization; the paper prints no roll controller."""

YAW_PID = RateGains(gain=0.27, zeros=(0.5, 0.9985))
"""Yaw has a tenth of pitch's acceleration, and the reaction of the rotors' inertia gives it lead, so it needs little
derivative: crossover 3 Hz. Tuned on the model's linearization; the paper prints no yaw controller."""

RATE_PIDS = (ROLL_PID, PITCH_PID, YAW_PID)

ALTITUDE_INTEGRAL = 0.8
"""Acceleration gained per climb rate error and time, 1/s². A guess; PX4's MPC_Z_VEL_I_ACC is 2."""

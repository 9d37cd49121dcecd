"""What the controllers must know about the tail-sitter beside its rate controllers."""

ALTITUDE_INTEGRAL = 0.8
"""Acceleration gained per climb rate error and time, 1/s². A guess; PX4's MPC_Z_VEL_I_ACC is 2."""

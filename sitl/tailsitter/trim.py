"""Hover found by a solver."""

from sitl.tailsitter.parameters import Parameters


def hover_thrust(p: Parameters) -> float:
    """Normalized thrust that carries the weight in still air far from the ground."""
    return p.mass * p.gravity / (4.0 * p.full_thrust * abs(p.axis_z))

"""Rotors: thrust and torque with advance ratio, ground and wall effect, and the slipstream behind them."""

from math import sqrt
from typing import Any

from sitl.tailsitter.compiled import compiled


@compiled
def coefficient(speed: float, axial: float, radius: float, zero_advance: float) -> float:
    """Share of the static thrust (or torque) left at an axial air speed, m/s, times speed²: ω² (1 − J / J₀).

    The straight line of the usual propeller data between hover and windmill; outside it is only a continuation.
    """
    return speed * (speed - axial * 3.141592653589793 / (radius * zero_advance))


@compiled
def ground_factor(height: float, p: Any) -> float:
    """Thrust near the ground over thrust far from it, at hub height `height`, m. Sanchez-Cuevas, Eq. (6).

    Four coplanar rotors over level ground, at least half a radius above it.
    """
    z, d, r = max(height, 0.5 * p["rotor_radius"]), p["ground_spacing"], p["rotor_radius"]
    b = 1.4142135623730951 * d
    z4 = 4.0 * z * z
    loss = (r * r) / (4.0 * z4)
    loss += r * r * z / sqrt((d * d + z4) ** 3)
    loss += 0.5 * r * r * z / sqrt((2.0 * d * d + z4) ** 3)
    loss += 2.0 * r * r * z / sqrt((b * b + z4) ** 3) * p["ground_fountain"]
    factor: float = 1.0 / (1.0 - min(loss, 0.5))
    return factor


@compiled
def wall_factor(distance: float, p: Any) -> float:
    """Thrust near a vertical wall over thrust far from it; `distance` from the hub, m.

    The wake recirculates and the rotor breathes it again. A guess in form and size; the sign (towards the wall) is that
    of published tests.
    """
    ratio = p["rotor_radius"] / max(distance, p["rotor_radius"])
    factor: float = 1.0 - p["wall_loss"] * ratio * ratio
    return factor


@compiled
def slipstream(thrust: float, axial: float, p: Any) -> float:
    """Air speed added at the wing behind a rotor, m/s, from momentum theory."""
    area = 3.141592653589793 * p["rotor_radius"] * p["rotor_radius"]
    half = 0.5 * max(axial, 0.0)
    induced = sqrt(half * half + max(thrust, 0.0) / (2.0 * p["air_density"] * area)) - half
    added: float = p["slipstream_share"] * p["slipstream_growth"] * induced
    return added

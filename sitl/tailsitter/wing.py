"""One wing panel at any angle of attack: a thin wing blended into a flat plate.

Attached flow gives a normal force K sin α |cos α| and keeps part of the leading-edge suction; separated flow gives the
plate's C_D90 sin α |sin α| across it (Beard and McLain, section 4.2; Newtonian). Written in sin α and cos α, so it is
smooth and symmetrical all the way round, tail first included, without a single angle.

Limits: a symmetrical section, steady flow (no dynamic stall), no interference between panels beyond the lift slope of
the whole wing, no elevons.
"""

from math import exp, sqrt
from typing import Any

from sitl.tailsitter.compiled import compiled
from sitl.tailsitter.layout import AIR, FORCE, TORQUE_SUM, TURN

STILL = 1e-6
"""Air speed below which there is no force, m/s."""


@compiled
def separation(sine: float, p: Any) -> float:
    """Share of separated flow, 0…1, at abs(sin α)."""
    return 1.0 / (1.0 + exp(-p["stall_rate"] * (sine - p["stall"])))


@compiled
def panel(normal: float, forward: float, p: Any) -> tuple[float, float, float]:
    """Force of one panel for its velocity through the air: `normal` (to the belly) and `forward` (to the nose), m/s.

    Returns the forces towards belly and nose, N, and how far behind the quarter chord they act, m.
    """
    square = normal * normal + forward * forward
    if square < STILL * STILL:
        return 0.0, 0.0, 0.0
    speed = sqrt(square)
    sine, cosine = normal / speed, forward / speed
    steep = abs(sine)
    plate = separation(steep, p)
    wing = 1.0 - plate
    pressure = 0.5 * p["air_density"] * square * p["panel_area"]
    cross = wing * p["lift_slope"] * sine * abs(cosine) + plate * p["plate_drag"] * sine * steep
    along = wing * p["suction"] * p["lift_slope"] * sine * sine - p["skin_drag"]
    return -pressure * cross, pressure * along * cosine, 0.25 * p["chord"] * plate * steep


@compiled
def wing_sum(blow: float, wing_z: float, p: Any, sums: Any) -> None:
    """Add wing panels and fuselage side to `sums`, for the velocity and rate through the air that stand there."""
    for i in range(4):
        y = p["panel_y"][i]
        normal = sums[AIR] + sums[TURN + 1] * wing_z - sums[TURN + 2] * y
        forward = -(sums[AIR + 2] + sums[TURN] * y) + blow * p["blown"][i]
        fx, up, behind = panel(normal, forward, p)
        fz = -up
        z = wing_z + behind
        sums[FORCE] += fx
        sums[FORCE + 2] += fz
        sums[TORQUE_SUM] += y * fz
        sums[TORQUE_SUM + 1] += z * fx
        sums[TORQUE_SUM + 2] -= y * fx
    sums[FORCE + 1] -= 0.5 * p["air_density"] * p["side_area"] * sums[AIR + 1] * abs(sums[AIR + 1])

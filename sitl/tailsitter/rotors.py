"""Rotors: thrust and torque with advance ratio, ground and wall effect, and the slipstream behind them.

Limits: rotors feel the air speed of the centre of mass. The damping that turning adds to their inflow is left out:
(11) is a pure integrator from 4 rad/s on and shows none.
"""

from math import sqrt
from typing import Any

from sitl.tailsitter.battery import battery
from sitl.tailsitter.compiled import compiled
from sitl.tailsitter.layout import (
    AIR,
    CHARGE,
    CHARGE_AT_START,
    COMMAND,
    EFFECTIVENESS,
    FORCE,
    POSITION,
    QUATERNION,
    ROTOR,
    SAG,
    SPIN,
    TORQUE_SUM,
    WALL,
)


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


@compiled
def rotor_forces(x: Any, u: Any, hub_z: float, p: Any, sums: Any) -> tuple[float, float]:
    """Add force, torque and spin of all rotors to `sums`; returns slipstream at the wing, m/s, and shaft power, W."""
    w, qx, qy, qz = x[QUATERNION], x[QUATERNION + 1], x[QUATERNION + 2], x[QUATERNION + 3]
    north_x, north_y = 1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy - w * qz)
    down_x, down_y, down_z = 2.0 * (qx * qz - w * qy), 2.0 * (qy * qz + w * qx), 1.0 - 2.0 * (qx * qx + qy * qy)
    high = p["leg"] - x[POSITION + 2] < 20.0 * p["rotor_radius"]  # farther up, ground effect is below 0.1 %
    walled = u[WALL] < 20.0 * p["rotor_radius"]
    power, blow = 0.0, 0.0
    nz = p["axis_z"]
    for i in range(4):
        rx, ry = p["rotor_x"][i], p["rotor_y"][i]
        nx, spin, speed = p["axis_x"][i], p["spin"][i], x[ROTOR + i]
        axial = sums[AIR] * nx + sums[AIR + 2] * nz
        thrust = p["thrust_constant"] * coefficient(speed, axial, p["rotor_radius"], p["zero_thrust_advance"])
        drag = p["torque_arm"] * p["thrust_constant"]
        drag *= coefficient(speed, axial, p["rotor_radius"], p["zero_torque_advance"])
        thrust *= u[EFFECTIVENESS + i]
        drag *= u[EFFECTIVENESS + i]
        if high:
            below = down_x * rx + down_y * ry + down_z * hub_z
            thrust *= ground_factor(p["leg"] - x[POSITION + 2] - below, p)
        if walled:
            thrust *= wall_factor(u[WALL] - north_x * rx - north_y * ry, p)
        power += drag * speed
        blow += 0.25 * slipstream(thrust, axial, p)
        momentum = p["rotor_inertia"] * spin * speed
        sums[SPIN] += momentum * nx
        sums[SPIN + 2] += momentum * nz
        k = p["rotor_drag"] * speed
        fx = thrust * nx - k * (sums[AIR] - axial * nx)
        fy = -k * sums[AIR + 1]
        fz = thrust * nz - k * (sums[AIR + 2] - axial * nz)
        sums[FORCE] += fx
        sums[FORCE + 1] += fy
        sums[FORCE + 2] += fz
        sums[TORQUE_SUM] += ry * fz - hub_z * fy - spin * drag * nx
        sums[TORQUE_SUM + 1] += hub_z * fx - rx * fz
        sums[TORQUE_SUM + 2] += rx * fy - ry * fx - spin * drag * nz
    return blow, power


@compiled
def spin_up(x: Any, u: Any, power: float, p: Any, sums: Any, dx: Any) -> None:
    """Rotors follow their commands as far as the battery lets them; what turns them turns the body the other way."""
    voltage = 1.0
    if u[SAG] != 0.0:
        voltage, current = battery(u[CHARGE_AT_START] - x[CHARGE], power, p)
        dx[CHARGE] = current / p["battery_capacity"]
    for i in range(4):
        command = min(1.0, max(0.0, u[COMMAND + i]))
        rate = (p["top_speed"] * voltage * sqrt(command) - x[ROTOR + i]) / p["rotor_lag"]
        dx[ROTOR + i] = rate
        push = p["rotor_inertia"] * p["spin"][i] * rate
        sums[TORQUE_SUM] -= push * p["axis_x"][i]
        sums[TORQUE_SUM + 2] -= push * p["axis_z"]

"""The rigid body: all forces and torques summed, and a fixed step of the classical Runge–Kutta method.

Limits: flat earth, constant air density; the principal axes are the hover axes; a payload is a point, and letting it go
does not move the origin; rotors feel the air speed of the centre of mass (see `parameters`: the damping that turning
adds to their inflow is not in (11), whose integrator shows none).
"""

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitl.tailsitter.battery import battery
from sitl.tailsitter.compiled import compiled
from sitl.tailsitter.flexible import flex
from sitl.tailsitter.layout import (
    ACCELERATION,
    AIR,
    CHARGE,
    CHARGE_AT_START,
    COMMAND,
    DISTURBANCE,
    EFFECTIVENESS,
    FLEXIBLE,
    FORCE,
    GAIN,
    HELD,
    INPUTS,
    MOMENT,
    PAYLOAD,
    POSITION,
    QUATERNION,
    RATE,
    ROTOR,
    SAG,
    SPECIFIC_FORCE,
    SPIN,
    STANDING,
    STATES,
    TORQUE,
    TORQUE_SUM,
    TURN,
    VELOCITY,
    WALL,
    WIND,
    WIND_RATE,
)
from sitl.tailsitter.rotors import coefficient, ground_factor, slipstream, wall_factor
from sitl.tailsitter.wing import panel

STEPS = 4
"""Runge–Kutta steps of a sample after the delay: 0.87 ms each, two fifths of the fastest mode's time constant."""


def workspace() -> NDArray[np.float64]:
    """Scratch for `derivative`, `step` and `sample`; shape (5, 30)."""
    return np.zeros((5, max(STATES, INPUTS)))


@compiled
def rotor_sum(x: Any, u: Any, hub_z: float, p: Any, sums: Any, dx: Any) -> float:
    """Add all rotors to `sums` and their accelerations to `dx`; returns the slipstream at the wing, m/s."""
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
        sums[TORQUE_SUM + 2] -= push * nz
    return blow


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


@compiled
def derivative(x: Any, u: Any, p: Any, sums: Any, dx: Any, out: Any) -> None:  # noqa: PLR0915
    """Rate of change of the state `x` under the inputs `u` (`layout`), into `dx`; sensors' share into `out`."""
    for i in range(STATES):
        dx[i] = 0.0
    for i in range(9):
        sums[i] = 0.0
    w, qx, qy, qz = x[QUATERNION], x[QUATERNION + 1], x[QUATERNION + 2], x[QUATERNION + 3]
    r00, r01, r02 = 1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy - w * qz), 2.0 * (qx * qz + w * qy)
    r10, r11, r12 = 2.0 * (qx * qy + w * qz), 1.0 - 2.0 * (qx * qx + qz * qz), 2.0 * (qy * qz - w * qx)
    r20, r21, r22 = 2.0 * (qx * qz - w * qy), 2.0 * (qy * qz + w * qx), 1.0 - 2.0 * (qx * qx + qy * qy)
    vn, ve, vd = x[VELOCITY] - u[WIND], x[VELOCITY + 1] - u[WIND + 1], x[VELOCITY + 2] - u[WIND + 2]
    sums[AIR] = r00 * vn + r10 * ve + r20 * vd
    sums[AIR + 1] = r01 * vn + r11 * ve + r21 * vd
    sums[AIR + 2] = r02 * vn + r12 * ve + r22 * vd
    for i in range(3):
        sums[TURN + i] = x[RATE + i] - u[WIND_RATE + i]
    # A payload below moves the centre of mass down: everything else is then higher.
    load = u[PAYLOAD]
    mass = p["mass"] + load
    lower = p["payload_arm"] * load / mass
    swing = p["mass"] * lower * p["payload_arm"]
    ix, iy, iz = p["inertia"][0] + swing, p["inertia"][1] + swing, p["inertia"][2]

    blow = rotor_sum(x, u, p["rotor_z"] - lower, p, sums, dx)
    px, py, pz = sums[TORQUE_SUM] * u[GAIN], sums[TORQUE_SUM + 1] * u[GAIN + 1], sums[TORQUE_SUM + 2] * u[GAIN + 2]
    sums[TORQUE_SUM], sums[TORQUE_SUM + 1], sums[TORQUE_SUM + 2] = 0.0, 0.0, 0.0
    wing_sum(blow, p["wing_z"] - lower, p, sums)

    # The paper's d enters where u_e does: through the rotors' lag, but without their limits.
    for i in range(3):
        dx[DISTURBANCE + i] = (u[TORQUE + i] - x[DISTURBANCE + i]) / p["rotor_lag"]
    scale = p["mixer_share"] * 4.0 * p["thrust_constant"] * p["top_speed"] * p["top_speed"]
    rx, ry = p["rotor_x"][0], p["rotor_y"][0]
    px += u[GAIN] * scale * abs(p["axis_z"]) * ry * x[DISTURBANCE]
    py += u[GAIN + 1] * scale * abs(p["axis_z"]) * rx * x[DISTURBANCE + 1]
    yaw_arm = -ry * p["axis_x"][0] + p["torque_arm"] * abs(p["axis_z"])
    pz += u[GAIN + 2] * scale * yaw_arm * x[DISTURBANCE + 2]
    if u[FLEXIBLE] != 0.0:
        flex(x, dx, out, px / ix, py / iy, pz / iz, p)

    a, b, c = x[RATE], x[RATE + 1], x[RATE + 2]
    hx, hy, hz = ix * a + sums[SPIN], iy * b + sums[SPIN + 1], iz * c + sums[SPIN + 2]
    px += sums[TORQUE_SUM] + u[MOMENT] - (b * hz - c * hy)
    py += sums[TORQUE_SUM + 1] + u[MOMENT + 1] - (c * hx - a * hz)
    pz += sums[TORQUE_SUM + 2] + u[MOMENT + 2] - (a * hy - b * hx)

    sx, sy, sz = sums[FORCE] / mass, sums[FORCE + 1] / mass, sums[FORCE + 2] / mass
    out[ACCELERATION] = r00 * sx + r01 * sy + r02 * sz
    out[ACCELERATION + 1] = r10 * sx + r11 * sy + r12 * sz
    out[ACCELERATION + 2] = r20 * sx + r21 * sy + r22 * sz + p["gravity"]
    held = u[HELD]
    if u[STANDING] != 0.0 or held >= 0.0:  # whatever holds it carries its weight
        out[SPECIFIC_FORCE] = -p["gravity"] * r20
        out[SPECIFIC_FORCE + 1] = -p["gravity"] * r21
        out[SPECIFIC_FORCE + 2] = -p["gravity"] * r22
    else:
        out[SPECIFIC_FORCE], out[SPECIFIC_FORCE + 1], out[SPECIFIC_FORCE + 2] = sx, sy, sz
        for i in range(3):
            dx[POSITION + i] = x[VELOCITY + i]
            dx[VELOCITY + i] = out[ACCELERATION + i]
    if u[STANDING] != 0.0:
        return
    if held < 0.0 or held == 0.0:
        dx[RATE] = px / ix
    if held < 0.0 or held == 1.0:
        dx[RATE + 1] = py / iy
    if held < 0.0 or held == 2.0:
        dx[RATE + 2] = pz / iz
    dx[QUATERNION] = 0.5 * (-qx * a - qy * b - qz * c)
    dx[QUATERNION + 1] = 0.5 * (w * a + qy * c - qz * b)
    dx[QUATERNION + 2] = 0.5 * (w * b - qx * c + qz * a)
    dx[QUATERNION + 3] = 0.5 * (w * c + qx * b - qy * a)


@compiled
def step(x: Any, u: Any, p: Any, h: float, work: Any, out: Any) -> None:
    """Advance the state `x` by `h` seconds with the inputs held: classical Runge–Kutta, then unit quaternion."""
    sums, k, between, dx = work[0], work[1], work[2], work[3]
    derivative(x, u, p, sums, dx, out)
    for i in range(STATES):
        k[i] = dx[i]
        between[i] = x[i] + 0.5 * h * dx[i]
    derivative(between, u, p, sums, dx, out)
    for i in range(STATES):
        k[i] += 2.0 * dx[i]
        between[i] = x[i] + 0.5 * h * dx[i]
    derivative(between, u, p, sums, dx, out)
    for i in range(STATES):
        k[i] += 2.0 * dx[i]
        between[i] = x[i] + h * dx[i]
    derivative(between, u, p, sums, dx, out)
    for i in range(STATES):
        x[i] += h / 6.0 * (k[i] + dx[i])
    w, a, b, c = x[QUATERNION], x[QUATERNION + 1], x[QUATERNION + 2], x[QUATERNION + 3]
    norm = 1.0 / sqrt(w * w + a * a + b * b + c * c)
    for i in range(4):
        x[QUATERNION + i] *= norm


@compiled
def sample(x: Any, u: Any, before: Any, params: Any, dt: float, steps: int, work: Any, out: Any) -> None:
    """Advance by one sample of `dt` seconds.

    The old commands and disturbance (`before`, seven numbers) act until the new ones arrive after the delay; then the
    rest of the sample passes in `steps` equal steps. `before` is then the new ones.
    """
    p = params[0]
    new = work[4]
    for i in range(7):
        new[i] = u[i]
        u[i] = before[i]
    delay = p["delay"]
    if delay > 0.0:
        step(x, u, p, delay, work, out)
    for i in range(7):
        u[i] = before[i] = new[i]
    for _ in range(steps):
        step(x, u, p, (dt - delay) / steps, work, out)

"""The rigid body: all forces and torques summed, and a fixed step of the classical Runge–Kutta method.

Limits: flat earth, constant air density; the principal axes are the hover axes; a payload is a point, and letting it go
does not move the origin.
"""

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitl.tailsitter.compiled import compiled
from sitl.tailsitter.flexible import flex
from sitl.tailsitter.layout import (
    ACCELERATION,
    AIR,
    DISTURBANCE,
    FLEXIBLE,
    FORCE,
    GAIN,
    HELD,
    INERTIA,
    INPUTS,
    MASS,
    MOMENT,
    PAYLOAD,
    PICKUP,
    POSITION,
    QUATERNION,
    RATE,
    SPECIFIC_FORCE,
    SPIN,
    STANDING,
    STATES,
    TORQUE,
    TORQUE_SUM,
    TURN,
    VELOCITY,
    WIND,
    WIND_RATE,
)
from sitl.tailsitter.rotors import rotor_forces, spin_up
from sitl.tailsitter.wing import wing_sum

STEPS = 4
"""Runge–Kutta steps of a sample after the delay: 0.87 ms each, two fifths of the fastest mode's time constant."""


def workspace() -> NDArray[np.float64]:
    """Scratch for `step` and `sample`; shape (5, 30)."""
    return np.zeros((5, max(STATES, INPUTS)))


@compiled
def through_air(x: Any, u: Any, sums: Any) -> None:
    """Velocity and rate relative to the air, hover axes, into `sums`."""
    w, a, b, c = x[QUATERNION], x[QUATERNION + 1], x[QUATERNION + 2], x[QUATERNION + 3]
    n, e, d = x[VELOCITY] - u[WIND], x[VELOCITY + 1] - u[WIND + 1], x[VELOCITY + 2] - u[WIND + 2]
    sums[AIR] = (1.0 - 2.0 * (b * b + c * c)) * n + 2.0 * (a * b + w * c) * e + 2.0 * (a * c - w * b) * d
    sums[AIR + 1] = 2.0 * (a * b - w * c) * n + (1.0 - 2.0 * (a * a + c * c)) * e + 2.0 * (b * c + w * a) * d
    sums[AIR + 2] = 2.0 * (a * c + w * b) * n + 2.0 * (b * c - w * a) * e + (1.0 - 2.0 * (a * a + b * b)) * d
    for i in range(3):
        sums[TURN + i] = x[RATE + i] - u[WIND_RATE + i]


@compiled
def load(u: Any, p: Any, sums: Any) -> float:
    """Mass and inertia with payload into `sums`; returns how far the payload lowers the centre of mass, m."""
    mass = p["mass"] + u[PAYLOAD]
    lower: float = p["payload_arm"] * u[PAYLOAD] / mass
    swing = p["mass"] * lower * p["payload_arm"]
    sums[MASS] = mass
    sums[INERTIA], sums[INERTIA + 1], sums[INERTIA + 2] = (
        p["inertia"][0] + swing,
        p["inertia"][1] + swing,
        p["inertia"][2],
    )
    return lower


@compiled
def control(x: Any, u: Any, p: Any, sums: Any, dx: Any) -> None:
    """Turn the rotors' torque into the plant's: add the disturbance and multiply by the gain of each axis.

    The paper's d enters where u_e does, through the rotors' lag, but without their limits.
    """
    scale = p["mixer_share"] * 4.0 * p["thrust_constant"] * p["top_speed"] * p["top_speed"]
    up = abs(p["axis_z"])
    rx, ry = p["rotor_x"][0], p["rotor_y"][0]
    sums[TORQUE_SUM] += scale * up * ry * x[DISTURBANCE]
    sums[TORQUE_SUM + 1] += scale * up * rx * x[DISTURBANCE + 1]
    sums[TORQUE_SUM + 2] += scale * (up * p["torque_arm"] - ry * p["axis_x"][0]) * x[DISTURBANCE + 2]
    for i in range(3):
        sums[TORQUE_SUM + i] *= u[GAIN + i]
        dx[DISTURBANCE + i] = (u[TORQUE + i] - x[DISTURBANCE + i]) / p["rotor_lag"]


@compiled
def accelerate(x: Any, u: Any, p: Any, sums: Any, out: Any) -> None:
    """Specific force and acceleration from the summed force."""
    w, a, b, c = x[QUATERNION], x[QUATERNION + 1], x[QUATERNION + 2], x[QUATERNION + 3]
    fx, fy, fz = sums[FORCE] / sums[MASS], sums[FORCE + 1] / sums[MASS], sums[FORCE + 2] / sums[MASS]
    dx, dy, dz = 2.0 * (a * c - w * b), 2.0 * (b * c + w * a), 1.0 - 2.0 * (a * a + b * b)  # where down is
    out[ACCELERATION] = (1.0 - 2.0 * (b * b + c * c)) * fx + 2.0 * (a * b - w * c) * fy + 2.0 * (a * c + w * b) * fz
    out[ACCELERATION + 1] = 2.0 * (a * b + w * c) * fx + (1.0 - 2.0 * (a * a + c * c)) * fy + 2.0 * (b * c - w * a) * fz
    out[ACCELERATION + 2] = dx * fx + dy * fy + dz * fz + p["gravity"]
    if u[STANDING] != 0.0 or u[HELD] >= 0.0:  # whatever holds it carries its weight
        fx, fy, fz = -p["gravity"] * dx, -p["gravity"] * dy, -p["gravity"] * dz
    out[SPECIFIC_FORCE], out[SPECIFIC_FORCE + 1], out[SPECIFIC_FORCE + 2] = fx, fy, fz


@compiled
def move(x: Any, u: Any, sums: Any, dx: Any, out: Any) -> None:
    """Rates of change of position, velocity, attitude and body rate (Newton and Euler), as far as it is free."""
    held = u[HELD]
    if u[STANDING] != 0.0:
        return
    if held < 0.0:
        for i in range(3):
            dx[POSITION + i] = x[VELOCITY + i]
            dx[VELOCITY + i] = out[ACCELERATION + i]
    w, qx, qy, qz = x[QUATERNION], x[QUATERNION + 1], x[QUATERNION + 2], x[QUATERNION + 3]
    a, b, c = x[RATE], x[RATE + 1], x[RATE + 2]
    hx = sums[INERTIA] * a + sums[SPIN]
    hy = sums[INERTIA + 1] * b + sums[SPIN + 1]
    hz = sums[INERTIA + 2] * c + sums[SPIN + 2]
    if held < 0.0 or held == 0.0:
        dx[RATE] = (sums[TORQUE_SUM] + u[MOMENT] - (b * hz - c * hy)) / sums[INERTIA]
    if held < 0.0 or held == 1.0:
        dx[RATE + 1] = (sums[TORQUE_SUM + 1] + u[MOMENT + 1] - (c * hx - a * hz)) / sums[INERTIA + 1]
    if held < 0.0 or held == 2.0:
        dx[RATE + 2] = (sums[TORQUE_SUM + 2] + u[MOMENT + 2] - (a * hy - b * hx)) / sums[INERTIA + 2]
    dx[QUATERNION] = 0.5 * (-qx * a - qy * b - qz * c)
    dx[QUATERNION + 1] = 0.5 * (w * a + qy * c - qz * b)
    dx[QUATERNION + 2] = 0.5 * (w * b - qx * c + qz * a)
    dx[QUATERNION + 3] = 0.5 * (w * c + qx * b - qy * a)


@compiled
def derivative(x: Any, u: Any, p: Any, sums: Any, dx: Any, out: Any) -> None:
    """Rate of change of the state `x` under the inputs `u` (`layout`), into `dx`; what sensors feel into `out`."""
    for i in range(STATES):
        dx[i] = 0.0
    for i in range(AIR):
        sums[i] = 0.0
    for i in range(3):
        out[PICKUP + i] = 0.0
    through_air(x, u, sums)
    lower = load(u, p, sums)  # the payload moves the centre of mass down: everything else is then higher
    blow, power = rotor_forces(x, u, p["rotor_z"] - lower, p, sums)
    spin_up(x, u, power, p, sums, dx)
    control(x, u, p, sums, dx)
    if u[FLEXIBLE] != 0.0:
        flex(x, dx, out, sums, p)
    wing_sum(blow, p["wing_z"] - lower, p, sums)
    accelerate(x, u, p, sums, out)
    move(x, u, sums, dx, out)


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

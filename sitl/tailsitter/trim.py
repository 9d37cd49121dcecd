"""Hover in still air or in a steady wind, found by Newton's method, and the airframe's linearization about it."""

from dataclasses import dataclass
from functools import lru_cache
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from sitl.airframe.mixer import Mixer
from sitl.attitude import ZERO, Quaternion, Vector, lean
from sitl.constants import DT, GRAVITY
from sitl.errors import FlightFailedError
from sitl.tailsitter.body import STEPS, derivative, sample, workspace
from sitl.tailsitter.layout import (
    ACCELERATION,
    CHARGE_AT_START,
    COMMAND,
    EFFECTIVENESS,
    FLEXIBLE,
    GAIN,
    HELD,
    INPUTS,
    MODE_RATE,
    OUTPUTS,
    PAYLOAD,
    POSITION,
    QUATERNION,
    RATE,
    ROTOR,
    STATES,
    SUMS,
    WALL,
    WIND,
)
from sitl.tailsitter.parameters import Parameters

Array = NDArray[np.float64]

ALTITUDE = 20.0
"""Where hover is sought, m: far from the ground."""

TOLERANCE = 1e-10
"""Largest acceleration left, m/s² and rad/s²."""

WIND_STEP = 1.0
"""The wind is brought up in steps of at most this size, m/s, so that Newton's method starts near each solution."""

HELD_OVER = 7
"""Commands and disturbance of the sample before, part of the state between samples."""


@dataclass(frozen=True, slots=True)
class Trim:
    """A steady hover: attitude, normalized torque and thrust, and the largest acceleration left, m/s² or rad/s²."""

    attitude: Quaternion
    torque: Vector
    thrust: float
    residual: float


@lru_cache(maxsize=64)
def trim(p: Parameters, wind: Vector = ZERO, payload_kg: float = 0.0) -> Trim:
    """Hover over a point with the belly to the north in this wind, m/s north-east-down.

    Six unknowns (lean north and east, three torques, thrust) against six accelerations; the Jacobian by differences.
    Raises FlightFailedError when there is none, as where the wind is stronger than the rotors.
    """
    size = sqrt(sum(v * v for v in wind))
    steps = max(1, round(size / WIND_STEP + 0.5))
    unknown = np.array([0.0, 0.0, 0.0, 0.0, 0.0, _weightless(p)])
    for k in range(1, steps + 1):
        unknown = _newton(p, tuple(v * k / steps for v in wind), payload_kg, unknown)
    north, east, roll, pitch, yaw, thrust = unknown.tolist()
    residual = float(np.abs(_accelerations(p, wind, payload_kg, unknown)).max())
    return Trim(lean(north, east), (roll, pitch, yaw), thrust, residual)


def _weightless(p: Parameters) -> float:
    """Thrust that carries the weight if nothing else acts: where the search begins."""
    return p.mass * p.gravity / (4.0 * p.full_thrust * abs(p.axis_z))


def _newton(p: Parameters, wind: tuple[float, ...], payload_kg: float, unknown: Array) -> Array:
    for _ in range(50):
        left = _accelerations(p, wind, payload_kg, unknown)
        if np.abs(left).max() < TOLERANCE:
            return unknown
        h = 1e-6
        columns = [
            (
                _accelerations(p, wind, payload_kg, unknown + h * e)
                - _accelerations(p, wind, payload_kg, unknown - h * e)
            )
            for e in np.eye(6)
        ]
        unknown = unknown - np.linalg.solve(np.array(columns).T / (2.0 * h), left)
        if not np.isfinite(unknown).all() or not 0.0 < unknown[5] < 1.0:
            break
    raise FlightFailedError(f"no hover in a wind of {wind} m/s with {payload_kg} kg; expected less of either")


def _hovering(p: Parameters, unknown: Array) -> tuple[Array, Array]:
    """State and commands of a hover with these unknowns, rotors at the speed of their commands."""
    north, east, roll, pitch, yaw, thrust = unknown.tolist()
    state = np.zeros(STATES)
    state[POSITION + 2] = -ALTITUDE
    state[QUATERNION : QUATERNION + 4] = lean(north, east)
    commands = np.array(Mixer(p.mixer_share, p.idle, 1.0).commands((roll, pitch, yaw), thrust))
    state[ROTOR : ROTOR + 4] = p.top_speed * np.sqrt(np.clip(commands, 0.0, 1.0))
    return state, commands


def _inputs(commands: Array, wind: tuple[float, ...], payload_kg: float) -> Array:
    u = np.zeros(INPUTS)
    u[COMMAND : COMMAND + 4] = commands
    u[WIND : WIND + 3] = wind
    u[WALL], u[HELD], u[CHARGE_AT_START] = inf, -1.0, 1.0
    u[EFFECTIVENESS : EFFECTIVENESS + 4] = 1.0
    u[GAIN : GAIN + 3] = 1.0
    u[PAYLOAD] = payload_kg
    return u


def _accelerations(p: Parameters, wind: tuple[float, ...], payload_kg: float, unknown: Array) -> Array:
    """Linear and angular acceleration of a hover with these unknowns; shape (6,)."""
    state, commands = _hovering(p, unknown)
    rates, out, sums = np.zeros(STATES), np.zeros(OUTPUTS), np.zeros(SUMS)
    derivative(state, _inputs(commands, wind, payload_kg), p.record()[0], sums, rates, out)
    return np.concatenate([out[ACCELERATION : ACCELERATION + 3], rates[RATE : RATE + 3]])


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """x(k+1) = A x(k) + B u_e(k), y(k) = C x(k) at `DT` about a hover: torque, normalized, to gyro rates, rad/s.

    The state is that of `layout` and the seven numbers held from the sample before: A (34, 34), B (34, 3), C (3, 34).
    """

    A: Array
    B: Array
    C: Array

    def response(self, frequency: Array, axis: int) -> NDArray[np.complex128]:
        """Frequency response of one axis at these frequencies, rad/s; shape as `frequency`."""
        one = np.eye(len(self.A))
        b, c = self.B[:, axis], self.C[axis]
        return np.array([c @ np.linalg.solve(np.exp(1j * w * DT) * one - self.A, b) for w in frequency])


def linearize(p: Parameters, wind: Vector = ZERO, flexible: bool = False) -> Linear:
    """The airframe from u_e to y about its hover in this wind, one sample at a time, by central differences."""
    at = trim(p, wind)
    base = at.torque
    unknown = np.array([*_leaning(at.attitude), *base, at.thrust])
    state, commands = _hovering(p, unknown)
    u = _inputs(commands, wind, 0.0)
    u[FLEXIBLE] = flexible
    mixer, params, work, out = Mixer(p.mixer_share, p.idle, 1.0), p.record(), workspace(), np.zeros(OUTPUTS)

    def after(x: Array, torque: Array) -> Array:
        now, before, inputs = x[:STATES].copy(), x[STATES:].copy(), u.copy()
        inputs[COMMAND : COMMAND + 4] = mixer.commands(tuple(base + torque), at.thrust)
        sample(now, inputs, before, params, DT, STEPS, work, out)
        return np.concatenate([now, before])

    x0, none = np.concatenate([state, commands, np.zeros(HELD_OVER - 4)]), np.zeros(3)
    h = np.full(len(x0), 1e-5)
    h[ROTOR : ROTOR + 4] = 1e-2
    A = [
        (after(x0 + d * e, none) - after(x0 - d * e, none)) / (2.0 * d) for d, e in zip(h, np.eye(len(x0)), strict=True)
    ]
    B = [(after(x0, 1e-5 * e) - after(x0, -1e-5 * e)) / 2e-5 for e in np.eye(3)]
    C = np.zeros((3, len(x0)))
    C[:, RATE : RATE + 3] = np.eye(3)
    if flexible:
        C[:, MODE_RATE : MODE_RATE + 3] = (p.mode_roll, p.mode_pitch, p.mode_yaw)
    return Linear(np.array(A).T, np.array(B).T, C)


def _leaning(q: Quaternion) -> tuple[float, float]:
    """Horizontal accelerations that `lean` turned into this attitude, m/s²."""
    w, x, y, _ = q
    k = GRAVITY / (2.0 * w * w - 1.0)
    return -2.0 * w * y * k, 2.0 * w * x * k

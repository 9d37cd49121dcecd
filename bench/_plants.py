"""The plants of docs/plants.md: what they are, where they come from, and the problem posed on each.

Plants that are stable fly without a baseline (C = 0), the others with a simple stabilizing one: gamma_star depends on
neither (exact model), which is itself a test.
"""

from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from dob_companion.synthesis import zpk
from dob_companion.synthesis.plant.models import discretize, stack

DT = 0.004


@dataclass(frozen=True, slots=True, eq=False)
class Plant:
    """A problem: plant, stabilizing controller, weights, link delay of each input, and the plant's source."""

    name: str
    kind: str
    source: str
    plant: Any
    controller: Any
    disturbance: Any
    noise: Any
    delay: int | tuple[int, ...] = 1

    @property
    def arguments(self) -> tuple[Any, ...]:
        """What `synthesize` takes."""
        return self.plant, self.controller, self.disturbance, self.noise


def all_plants() -> list[Plant]:
    """Every plant of the table, in its order."""
    return [*_paper(), *_siso(), *_mimo()]


PAPER = "H∞ DOB paper, eqs. (11)–(13)"
PITCH = zpk([-1.716], [1.0, 0.9447], 0.14131, DT)
PID = zpk([0.8343, 0.9987], [0.0, 1.0], 0.9002, DT)
W_D = zpk([-0.8997], [0.9962], 0.19908, DT)
W_N = zpk([0.9949], [-0.925], 3.7584, DT)


def _paper() -> list[Plant]:
    flexible = PITCH * discretize(
        _modes(((60.0, 0.01, 80.0), (180.0, 0.01, 200.0), (420.0, 0.02, 450.0))), DT, "tustin"
    )
    newton_metres = 0.35  # N m per normalized torque, a guess at the paper's vehicle
    return [
        *(Plant(f"paper pitch, delay {tau}", "integrating, NMP", PAPER, PITCH, PID, W_D, W_N, tau) for tau in range(4)),
        Plant("paper pitch in mN m", "integrating, NMP", PAPER, PITCH / (1e3 * newton_metres),
              PID * (1e3 * newton_metres), W_D * (1e3 * newton_metres), W_N),
        Plant("paper pitch, three flexible modes", "integrating, NMP, lightly damped",
              "paper, Fig. 6 (three modes between 50 and 600 rad/s); frequencies ours", ct.ss(flexible), static(0.05), W_D, W_N),
    ]  # fmt: skip


def _siso() -> list[Plant]:
    s = ct.tf("s")
    slow_zero = (5 - s) / ((s + 1) * (s + 20))
    pendulum = 20.0 / (s**2 - 9.0)
    return [
        Plant("minimum phase", "integrating", "theory: zero inside the circle", zpk([-0.5], [1.0, 0.9], 0.05, DT),
              static(0.2), W_D, W_N),
        Plant("slow right-half-plane zero", "stable, NMP", "zero at +5 rad/s", sampled(slow_zero), static(0.0), W_D, W_N),
        Plant("lightly damped mode", "stable, lightly damped", "ζ = 0.005 at 50 rad/s",
              sampled(2500 / (s**2 + 0.5 * s + 2500)), static(0.0), W_D, W_N),
        Plant("double integrator", "integrating", "position of a free mass", sampled(10 / s**2),
              zpk([0.985], [0.6], 6.0, DT), W_D, W_N),
        Plant("inverted pendulum", "unstable", "rod of 1.1 m, √(g/l) = 3 rad/s", sampled(pendulum),
              zpk([0.98], [0.6], 80.0, DT), W_D, W_N),
        Plant("first-order lag", "stable", "DC motor, τ = 0.1 s", sampled(10 / (s + 10)), static(0.0), W_D, W_N),
        Plant("lag behind three samples", "stable, delayed", "the plant's own delay",
              ct.ss(zpk([], [0.0, 0.0, 0.0, 0.96], 0.04, DT)), static(0.0), W_D, W_N),
        Plant("direct feedthrough", "stable, biproper", "accelerometer on a lever",
              zpk([0.8], [0.95], 0.5, DT), static(0.0), W_D, W_N),
        Plant("disk drive voice coil", "integrating, lightly damped",
              "rigid body and a 2.2 kHz mode, after Chen et al., Hard Disk Drive Servo Systems (2006), at 20 kHz",
              _disk_drive(), zpk([0.97], [0.5], 0.9, 5e-5), zpk([-0.9], [0.999], 0.05, 5e-5),
              zpk([0.9949], [-0.925], 3.0, 5e-5)),
        Plant("quadcopter roll", "integrating, delayed", "316 rad/s² per unit, 15 ms lag: ArduPilot SITL, measured",
              sampled(316 / (s * (0.015 * s + 1))), static(0.01), W_D, W_N),
        Plant("quadcopter yaw", "integrating", "14 rad/s² per unit: ArduPilot SITL, measured",
              sampled(14 / (s * (0.015 * s + 1))), static(0.2), W_D, W_N, 2),
        Plant("all-pass", "stable, NMP", "(1 − s/30)/(1 + s/30) behind a lag",
              sampled((30 - s) / (30 + s) * 20 / (s + 20)), static(0.0), W_D, W_N),
    ]  # fmt: skip


def _mimo() -> list[Plant]:
    s = ct.tf("s")
    coupled = ct.append(PITCH, 0.6 * PITCH, 0.35 * PITCH)
    mix = np.array([[1.0, 0.15, -0.1], [0.1, 1.0, 0.2], [-0.05, 0.1, 1.0]])
    axes3 = ct.ss(coupled.A, coupled.B @ mix, coupled.C, coupled.D, DT)
    gains = np.diag([0.1, 0.1 / 0.6, 0.1 / 0.35])
    minutes = 1.0
    return [
        Plant("three axes, decoupled", "MIMO 3×3, NMP", PAPER, coupled, static(gains), each(W_D, 3), each(W_N, 3)),
        Plant("three axes, coupled", "MIMO 3×3, NMP", PAPER + ", mixer errors of 5–20 %", axes3, static(gains),
              each(W_D, 3), each(W_N, 3)),
        Plant("three axes, delays 1, 2, 3", "MIMO 3×3, NMP, delays differ", PAPER, axes3, static(gains), each(W_D, 3),
              each(W_N, 3), (1, 2, 3)),
        Plant("units 1e6 apart", "MIMO 2×2", "moments in mN m and normalized, rates in rad/s and mdeg/s",
              ct.ss(*_rescaled(), DT), static(np.zeros((2, 2))), ct.append(W_D, W_D * 1e3),
              ct.append(W_N, W_N * 1e3)),
        Plant("two gyros, one moment", "MIMO 2×1", "redundant sensors of different noise",
              ct.ss(PITCH.A, PITCH.B, np.vstack([PITCH.C, PITCH.C]), np.zeros((2, 1)), DT), static([[0.05, 0.05]]), W_D,
              ct.append(W_N, W_N * 3.0)),
        Plant("one gyro, two moments", "MIMO 1×2", "two actuators, one of them slow",
              _side_by_side(sampled(10 / (s + 10)), sampled(4 / (s + 2))), static(np.zeros((2, 1))), each(W_D, 2), W_N),
        Plant("Wood–Berry column", "MIMO 2×2, stable, delayed", "Wood and Berry, Chem. Eng. Sci. 28 (1973), at 1 min",
              _wood_berry(minutes), static(np.zeros((2, 2)), minutes), each(zpk([], [0.98], 0.05, minutes), 2),
              each(zpk([0.9], [-0.5], 1.0, minutes), 2)),
        Plant("quadruple tank, NMP setting", "MIMO 2×2, stable, NMP", "Johansson, IEEE Trans. CST 8(3) (2000), P+, at 3 s",
              _quadruple_tank(3.0), static(np.zeros((2, 2)), 3.0), each(zpk([], [0.995], 0.02, 3.0), 2),
              each(zpk([0.9], [-0.5], 1.0, 3.0), 2)),
        Plant("ill-conditioned column", "MIMO 2×2, stable",
              "Skogestad, Morari and Doyle, IEEE TAC 33(12) (1988), at 1 min",
              sampled(_matrix([[87.8, -86.4], [108.2, -109.6]]) * (1 / (75 * s + 1)), minutes),
              static(np.zeros((2, 2)), minutes), each(zpk([], [0.98], 0.05, minutes), 2),
              each(zpk([0.9], [-0.5], 1.0, minutes), 2)),
        Plant("Rosenbrock's example", "MIMO 2×2, stable, NMP", "Rosenbrock, State-space and Multivariable Theory (1970)",
              _rosenbrock(), static(np.zeros((2, 2)), 0.05), each(zpk([], [0.98], 0.05, 0.05), 2),
              each(zpk([0.9], [-0.5], 1.0, 0.05), 2)),
    ]  # fmt: skip


def static(gain: Any, dt: float = DT) -> Any:
    """A constant gain as state space."""
    return ct.ss([], [], [], np.atleast_2d(np.asarray(gain, dtype=float)), dt)


def sampled(system: Any, dt: float = DT) -> Any:
    """Zero-order hold."""
    return discretize(ct.ss(system), dt, "zoh")


def each(weight: Any, channels: int) -> Any:
    """The same weight on every channel."""
    return stack(weight for _ in range(channels))


def _modes(modes: tuple[tuple[float, float, float], ...]) -> Any:
    """Unit gain with an antiresonance and resonance (rad/s) of one damping for each mode."""
    s = ct.tf("s")
    total = ct.tf([1.0], [1.0])
    for low, damping, high in modes:
        anti = (s**2 + 2 * damping * low * s + low**2) / low**2
        total = total * anti * (high**2 / (s**2 + 2 * damping * high * s + high**2))
    return ct.ss(total)


def _disk_drive() -> Any:
    s = ct.tf("s")
    mode = 2 * np.pi * 2200
    return sampled(1e7 / s**2 * mode**2 / (s**2 + 2 * 0.02 * mode * s + mode**2), 5e-5)


def _matrix(gain: list[list[float]]) -> Any:
    return ct.ss([], [], [], gain)


def _rescaled() -> tuple[Any, ...]:
    base = sampled(ct.ss([[-3.0, 1.0], [0.5, -8.0]], np.eye(2) * 20, np.eye(2), np.zeros((2, 2))))
    rates, moments = np.diag([1.0, 1e3]), np.diag([1.0, 1e-3])
    return base.A, base.B @ moments, rates @ base.C, np.zeros((2, 2))


def _side_by_side(first: Any, second: Any) -> Any:
    both = ct.append(first, second)
    return ct.ss(both.A, both.B, both.C[:1] + both.C[1:], np.zeros((1, 2)), first.dt)


def _entries(rows: list[list[tuple[float, float, int]]], dt: float) -> Any:
    """A matrix of first-order lags: gain, time constant, and whole samples of delay."""
    columns = []
    for j in range(len(rows[0])):
        lags = []
        for row in rows:
            gain, tau, delay = row[j]
            pole = float(np.exp(-dt / tau))
            lags.append(ct.ss(zpk([], [0.0] * delay + [pole], gain * (1 - pole), dt)))
        column = ct.append(*lags)
        columns.append(
            ct.ss(column.A, column.B @ np.ones((len(lags), 1)), column.C, column.D @ np.ones((len(lags), 1)), dt)
        )
    total = ct.append(*columns)
    add = np.kron(np.ones((1, len(columns))), np.eye(len(rows)))
    return ct.ss(total.A, total.B, add @ total.C, add @ total.D, dt)


def _wood_berry(dt: float) -> Any:
    return _entries([[(12.8, 16.7, 1), (-18.9, 21.0, 3)], [(6.6, 10.9, 7), (-19.4, 14.4, 3)]], dt)


def _quadruple_tank(dt: float) -> Any:
    s = ct.tf("s")
    rows = [
        [1.5 / (63 * s + 1), 2.5 / ((39 * s + 1) * (63 * s + 1))],
        [2.5 / ((56 * s + 1) * (91 * s + 1)), 1.6 / (91 * s + 1)],
    ]
    return sampled(_realized(rows), dt)


def _rosenbrock() -> Any:
    s = ct.tf("s")
    return sampled(_realized([[1 / (s + 1), 2 / (s + 3)], [1 / (s + 1), 1 / (s + 1)]]), 0.05)


def _realized(rows: list[list[Any]]) -> Any:
    """A transfer matrix as state space, an entry at a time."""
    columns = []
    for j in range(len(rows[0])):
        stacked = ct.append(*(ct.ss(row[j]) for row in rows))
        fan = np.ones((len(rows), 1))
        columns.append(ct.ss(stacked.A, stacked.B @ fan, stacked.C, stacked.D @ fan))
    total = ct.append(*columns)
    add = np.kron(np.ones((1, len(columns))), np.eye(len(rows)))
    return ct.ss(total.A, total.B, add @ total.C, add @ total.D)

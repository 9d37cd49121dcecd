"""How a block behaves, beside its frequency responses: roots, open-loop curve, answers to a step and to a gust."""

from dataclasses import dataclass

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import DobBlock, StateSpaceData
from dob_companion.lti.response import response
from dob_companion.synthesis.plant.loop import Loop, close_loop
from dob_companion.synthesis.plant.models import from_data

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SHOWN_S = 2.0
"""How long answers to a disturbance are shown …"""

FEWEST, MOST = 100, 5000
"""… but no fewer samples than the first and no more than the second, whatever the rate."""


@dataclass(frozen=True, slots=True, eq=False)
class Roots:
    """Zeros and poles of a system, and its gain over monic factors; the gain is NaN unless it is SISO."""

    zeros: Complex
    poles: Complex
    gain: float


@dataclass(frozen=True, slots=True, eq=False)
class TimeResponse:
    """One axis under one disturbance: t in s, d and d_hat (as it acts, delayed) in moment, rates in rad/s."""

    t: Array
    d: Array
    d_hat: Array
    rate_off: Array
    rate_on: Array


@dataclass(frozen=True, slots=True, eq=False)
class Loops:
    """The closed loops of a block without and with its observer."""

    off: Loop
    on: Loop
    dt: float


def loops_of(block: DobBlock, dt: float) -> Loops:
    """Both loops, wired from the stored matrices."""
    plant, controller, observer = (
        from_data(data, dt) for data in (block.problem.plant, block.problem.controller, block.observer)
    )
    delays = (block.delay_samples,) * len(block.axes)
    return Loops(close_loop(plant, controller, None, delays), close_loop(plant, controller, observer, delays), dt)


def roots(data: StateSpaceData, dt: float) -> Roots:
    """Transmission zeros, poles, and for a SISO system the gain k of k Π(z − z_i) / Π(z − p_i)."""
    system = from_data(data, dt)
    poles = np.linalg.eigvals(data.A).astype(complex)
    if data.D.shape != (1, 1):
        square = data.D.shape[0] == data.D.shape[1]
        zeros: Complex = np.asarray(ct.zeros(system) if square else [], dtype=np.complex128)
        return Roots(zeros, poles, float("nan"))
    zeros = np.asarray(ct.zeros(system), dtype=np.complex128)
    away = 2.0 + float(np.max(np.abs(np.concatenate([zeros, poles])), initial=0.0))
    gain = system(away) * np.prod(away - poles) / np.prod(away - zeros)
    return Roots(zeros, poles, float(np.real(gain)))


def open_loop(loop: Loop, axis: int, hertz: Array, dt: float) -> Complex:
    """L of one axis, broken at u_e while the other axes stay closed: from S = d -> u_e + d, L = 1/S − 1."""
    S = response(loop.part("u_e", "d"), 2.0 * np.pi * hertz * dt) + np.eye(loop.m)
    L: Complex = 1.0 / S[:, axis, axis] - 1.0
    return L


def step_response(loops: Loops, axis: int, size: float) -> TimeResponse:
    """A disturbance of `size` that begins at t = 0 and stays, for half of what is shown of a gust."""
    t = _time(loops)
    t = t[: len(t) // 2]
    return _respond(loops, axis, t, np.full_like(t, size))


def gust_response(loops: Loops, axis: int, size: float) -> TimeResponse:
    """One gust ½ (1 − cos 2πt/T) of `size`, the discrete gust of CS-25.341; T is half of what is shown, 1 s."""
    t = _time(loops)
    length = len(t) // 2 * loops.dt
    rise: Array = size / 2.0 * (1.0 - np.cos(2.0 * np.pi * t / length))
    return _respond(loops, axis, t, np.where(t < length - loops.dt / 2.0, rise, 0.0))


def _time(loops: Loops) -> Array:
    return np.arange(round(min(max(SHOWN_S / loops.dt, FEWEST), MOST)), dtype=np.float64) * loops.dt


def _respond(loops: Loops, axis: int, t: Array, d: Array) -> TimeResponse:
    def run(loop: Loop, output: str) -> Array:
        """Sample by sample: python-control's routine compares times, which tiny and huge steps do not survive."""
        part = loop.part(output, "d")
        C, D, x = part.C[axis], part.D[axis, axis], np.zeros(part.nstates)
        y = np.empty_like(d)
        for k, moment in enumerate(d):
            y[k] = C @ x + D * moment
            x = part.A @ x + part.B[:, axis] * moment
        return y

    return TimeResponse(t, d, d - run(loops.on, "error"), run(loops.off, "y"), run(loops.on, "y"))

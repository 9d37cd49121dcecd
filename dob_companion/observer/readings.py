"""What a design makes of a moment that is not told of each sample but read now and then, beside the controller.

Between two readings the moment is taken to lie on a line, which misses a part of what swings fast. The observer takes
the moment off what the gyro shows, so that part comes back in its estimate, in the correction, and round the loop in
the moment itself.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import DobBlock, DobDesign
from dob_companion.lti.response import largest, response
from dob_companion.lti.statespace import System

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MISREAD = 0.1
"""Of what swings at any frequency, what its readings miss may come back as this share of it at most. More was seen to
turn into oscillations at 25 to 30 Hz (docs/ardupilot.md)."""

POINTS = 2000
"""Angles that are looked at, evenly up to pi: nothing is missed of what is slow."""


class _Loop(Protocol):
    @property
    def plant(self) -> System: ...
    @property
    def controller(self) -> System: ...


def missed(angles: Array, dt: float, moment_hz: float) -> Array:
    """Share of a sine that a line between readings of it, `moment_hz` times a second, does not show: 1 - sinc^2, the
    gain of linear interpolation. Angles in rad per sample of dt, s."""
    return np.asarray(1.0 - np.sinc(angles / (2.0 * np.pi * dt * moment_hz)) ** 2)


def misreading(problem: _Loop, observer: System, delays: Sequence[int], dt: float, moment_hz: float) -> float:
    """The largest gain of (I + C G)^-1 z^-τ D_u, from an error of u_e to u_e itself round the loop, times `missed`.

    `observer` has inputs [y_n; u_e]; delays in samples, one for each moment; dt in s.
    """
    angles = np.linspace(0.0, np.pi, POINTS + 1)[1:]
    G, C = response(problem.plant, angles), response(problem.controller, angles)
    late = np.exp(-1j * np.outer(angles, delays))[:, :, None]
    told = late * response(observer, angles)[:, :, G.shape[1] :]
    around: ComplexArray = np.asarray(np.linalg.solve(np.eye(len(delays)) + C @ G, told), np.complex128)
    back: Array = missed(angles, dt, moment_hz) * largest(around)
    return float(np.max(back))


def misread_in(block: DobBlock, dt: float, moment_hz: float) -> float:
    """`misreading` of a designed block."""
    return misreading(block.problem, block.observer, (block.delay_samples,) * len(block.axes), dt, moment_hz)


def misread_by(design: DobDesign, moment_hz: float) -> float:
    """That of a design's worst block."""
    return max(misread_in(block, design.dt, moment_hz) for block in design.blocks)

"""A block of a design in numbers: what its page draws, computed from the stored matrices and the certificate."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import DobBlock
from dob_companion.artifact.flyable import GREATEST_COMMAND_LEAK, LEAST_DELAY_MARGIN_SAMPLES, LEAST_DISK_MARGIN
from dob_companion.synthesis.certify.behaviour import (
    Complex,
    Loops,
    Roots,
    TimeResponse,
    gust_response,
    loops_of,
    open_loop,
    roots,
    step_response,
)
from dob_companion.synthesis.certify.responses import Responses, block_responses
from dob_companion.synthesis.robust.bands import Bands, robust_bands

TEST_MOMENT = 0.1
"""Size of the step and the gust, normalized torque."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisResponses:
    """One axis of a block: its responses, its place in them, and the gamma that bounds them."""

    axis: str
    of: Responses
    index: int
    gamma: float

    def own(self, response: Complex) -> Complex:
        """The diagonal entry of this axis, shape (frequencies,)."""
        entry: Complex = response[:, self.index, self.index]
        return entry


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AxisValues:
    """One axis of a block, the loops of the others closed.

    responses                     over frequency
    open_loop_off, open_loop_on   (frequencies,) broken at u_e
    disk_margin                   of this axis
    step, gust                    answers to TEST_MOMENT; the gust lasts gust_s
    """

    responses: AxisResponses
    open_loop_off: Complex
    open_loop_on: Complex
    disk_margin: float
    step: TimeResponse
    gust: TimeResponse
    gust_s: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BlockValues:
    """A block: its axes, the roots of its parts, the closed loop's poles, and the spread over its uncertainty."""

    axes: tuple[AxisValues, ...]
    plant: Roots
    controller: Roots
    disturbance_weight: Roots
    noise_weight: Roots
    observer: Roots
    closed_loop_poles: NDArray[np.complex128]
    bands: Bands | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdicts:
    """Whether the numbers recorded in a certificate bear out what it claims, and what follows from them.

    ratio                 gamma over gamma_star
    least_gain, most_gain   gain errors that the disk margin a allows, (2 − a)/(2 + a) and (2 + a)/(2 − a), the
                          second infinite from a = 2; phase_deg errors up to 2 atan(a/2) (Seiler, Packard and
                          Gahinet, IEEE Control Systems 40, 2020)
    """

    near_optimal: bool
    stable: bool
    no_algebraic_loop: bool
    deaf_to_commands: bool
    robust_in_gain_and_phase: bool
    robust_in_delay: bool
    estimates_in_band: bool
    ratio: float
    least_gain: float
    most_gain: float
    phase_deg: float


def block_values(block: DobBlock, dt: float) -> BlockValues:
    """The numbers of one block, sample time `dt` in s."""
    loops, problem = loops_of(block, dt), block.problem
    return BlockValues(
        axes=tuple(_axis(block, loops, each) for each in axis_responses(block, dt)),
        plant=roots(problem.plant, dt),
        controller=roots(problem.controller, dt),
        disturbance_weight=roots(problem.disturbance_weight, dt),
        noise_weight=roots(problem.noise_weight, dt),
        observer=roots(block.observer, dt),
        closed_loop_poles=np.linalg.eigvals(loops.on.system.A).astype(complex),
        bands=robust_bands(block, dt),
    )


def axis_responses(block: DobBlock, dt: float) -> list[AxisResponses]:
    """The responses of a block, one entry per axis."""
    responses = block_responses(block, dt)
    return [AxisResponses(axis, responses, i, block.certificate.gamma) for i, axis in enumerate(block.axes)]


def verdicts(block: DobBlock) -> Verdicts:
    """From the numbers recorded in the block's file."""
    proof, m, a = block.certificate, len(block.axes), block.certificate.disk_margin
    return Verdicts(
        near_optimal=proof.gamma <= proof.gamma_backoff * proof.gamma_star,
        stable=proof.closed_loop_spectral_radius < 1.0 and proof.observer_spectral_radius < 1.0,
        no_algebraic_loop=not np.any(block.observer.D[:, m:] != 0.0),
        deaf_to_commands=abs(proof.command_leak) <= GREATEST_COMMAND_LEAK,
        robust_in_gain_and_phase=a >= LEAST_DISK_MARGIN,
        robust_in_delay=proof.delay_margin_samples >= LEAST_DELAY_MARGIN_SAMPLES,
        estimates_in_band=proof.estimation_bandwidth_hz > 0.0,
        ratio=proof.gamma / proof.gamma_star,
        least_gain=(2.0 - a) / (2.0 + a),
        most_gain=(2.0 + a) / (2.0 - a) if a < 2.0 else math.inf,
        phase_deg=math.degrees(2.0 * math.atan(a / 2.0)),
    )


def axis_disk_margin(block: DobBlock, axis: int) -> float:
    """The disk margin of one axis, the others exact, or that of all at once where the file has no other."""
    each = block.certificate.extra.get("disk_margin_per_axis")
    if isinstance(each, list) and len(each) == len(block.axes) and isinstance(each[axis], float):
        return float(each[axis])
    return block.certificate.disk_margin


def _axis(block: DobBlock, loops: Loops, responses: AxisResponses) -> AxisValues:
    i, hertz = responses.index, responses.of.frequency_hz
    gust = gust_response(loops, i, TEST_MOMENT)
    return AxisValues(
        responses=responses,
        open_loop_off=open_loop(loops.off, i, hertz, loops.dt),
        open_loop_on=open_loop(loops.on, i, hertz, loops.dt),
        disk_margin=axis_disk_margin(block, i),
        step=step_response(loops, i, TEST_MOMENT),
        gust=gust,
        gust_s=len(gust.t) // 2 * loops.dt,
    )

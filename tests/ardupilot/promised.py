"""What a design promises of a flight before it flies: attitude error off / on, from its own matrices.

The plant, the controllers, the delay and the gyro noise are those that the design holds; the disturbance is the
flight's. Nothing of a flight comes in.
"""

from collections.abc import Mapping

import numpy as np

from dob_companion.artifact import DobBlock, DobDesign
from dob_companion.lti.response import response
from dob_companion.synthesis.optimal.problem import Spectrum
from dob_companion.synthesis.optimal.reached import attenuation, recorded_weather
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.plant.stored import problem_of
from dob_companion.synthesis.spec.spectrum import LowPass, Measured, Shape
from tests.ardupilot.programs import PROGRAMS, Program

NOISE_HZ, SINE_HZ, NARROW = 1.0, 0.5, 1.02
"""Of the programs, and a ratio of frequencies that is a line to the grid of the prediction."""

SHAPES: Mapping[str, Shape] = {
    "noise": LowPass(NOISE_HZ),
    "sine": Measured(
        (SINE_HZ / NARROW**2, SINE_HZ / NARROW, SINE_HZ * NARROW, SINE_HZ * NARROW**2), (1e-9, 1, 1, 1e-9)
    ),
}


def acceleration(block: DobBlock, dt: float) -> float:
    """rad/s² per unit of torque near NOISE_HZ, which turns a disturbance into torque."""
    w = 2.0 * np.pi * NOISE_HZ
    return float(w * abs(response(from_data(block.problem.plant, dt), np.array([w * dt]))[0, 0, 0]))


def promised(block: DobBlock, dt: float, program: Program) -> float | None:
    """RMS of the attitude error off / on in a program about this block's axis; None for steps and calm air."""
    if program.shape not in SHAPES or not program.amplitude:
        return None
    auto = recorded_weather(block.certificate.extra, dt, block.name)
    if auto is None:
        return None
    rms = program.amplitude / (np.sqrt(2.0) if program.shape == "sine" else 1.0)
    spectrum = Spectrum(SHAPES[program.shape], rms / acceleration(block, dt))
    return attenuation(problem_of(block, dt), from_data(block.observer, dt), auto, spectrum)


def promises(design: DobDesign, programs: Mapping[str, Program] = PROGRAMS) -> dict[tuple[str, str], float]:
    """By program and axis, where the design has one for it."""
    found = {}
    for block in design.blocks:
        for name, program in programs.items():
            if block.axes == program.axes and (ratio := promised(block, design.dt, program)) is not None:
                found[name, block.axes[0]] = ratio
    return found

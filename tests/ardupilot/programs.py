"""The disturbances that the simulators are flown in."""

import math
from dataclasses import dataclass

import numpy as np

AXES = ("roll", "pitch", "yaw")
UPDATE_S = 0.04


@dataclass(frozen=True)
class Program:
    """A disturbance, angular acceleration in rad/s² about some axes, and how long each window is."""

    axes: tuple[str, ...]
    amplitude: float
    shape: str
    window_s: float = 20.0


PROGRAMS = {
    "calm": Program(AXES, 0.0, "sine"),
    "sine-roll": Program(("roll",), 6.0, "sine"),
    "sine-pitch": Program(("pitch",), 6.0, "sine"),
    "noise-roll": Program(("roll",), 6.0, "noise", 30.0),
    "noise-pitch": Program(("pitch",), 6.0, "noise", 30.0),
    "noise-yaw": Program(("yaw",), 1.0, "noise", 30.0),
    "step-roll": Program(("roll",), 6.0, "step", 10.0),
    "step-pitch": Program(("pitch",), 6.0, "step", 10.0),
    "step-yaw": Program(("yaw",), 1.0, "step", 10.0),
}


def signal(program: Program, seconds: float) -> np.ndarray:
    """The disturbance, a value for each UPDATE_S."""
    n = math.ceil(seconds / UPDATE_S)
    t = np.arange(n) * UPDATE_S
    if program.shape == "sine":
        return program.amplitude * np.sin(2 * math.pi * 0.5 * t)
    if program.shape == "step":
        return np.full(n, program.amplitude)
    pole = math.exp(-2 * math.pi * 1.0 * UPDATE_S)  # white noise through a 1 Hz low-pass
    noise, value = np.random.default_rng(7).standard_normal(n), 0.0
    values = []
    for w in noise:
        value = pole * value + math.sqrt(1 - pole * pole) * w
        values.append(program.amplitude * value)
    return np.array(values)

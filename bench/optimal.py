"""The best observer of one axis beside a search among weights, at equal limits: attenuation and time.

Limits are the disk margin, noise and delay margin that weights searched by hand had reached on the tail-sitter's axes.
The search is the one for coupled axes. Attenuation is the RMS attitude error off / on in the paper's weather,
gyro noise included, by the Lyapunov equations of the closed loop: at 0.7, 1 and 1.3 of the plant's gain. Times are of
one core.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from dob_companion.comparison.flight import DISTURBANCE_HZ, NOISE_SIGMA, expect
from dob_companion.comparison.vehicle import ATTITUDE_GAIN, Vehicle, close, no_observer
from dob_companion.errors import DobError
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.optimal.problem import Axis, Spectrum, Wanted
from dob_companion.synthesis.optimal.search import Search
from dob_companion.synthesis.plant.models import from_data, to_state_space
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import BlockSpec
from dob_companion.synthesis.spec.spectrum import LowPass
from dob_companion.synthesis.tune.coupled import searched_design

SPEC = Path(__file__).parents[1] / "examples" / "tailsitter_paper.toml"

RMS = {"pitch": 0.0537, "roll": 0.0390, "yaw": 0.0451}
"""Of the disturbance, normalized torque: the peaks of the paper's Section IV, in the mean of 20 seeds."""

LIMITS = {
    ("pitch", 0): (0.4028, 3.000e-4, 2),
    ("roll", 0): (0.4128, 1.080e-3, 2),
    ("yaw", 0): (0.9349, 4.097e-4, 2),
    ("pitch", 1): (0.4002, 2.997e-4, 2),
    ("roll", 1): (0.4119, 1.075e-3, 2),
    ("yaw", 1): (0.8822, 4.107e-4, 2),
    ("pitch", 2): (0.3812, 3.010e-4, 2),
    ("roll", 2): (0.3669, 1.017e-3, 2),
    ("yaw", 2): (0.8158, 5.171e-4, 2),
    ("pitch", 3): (0.3809, 3.011e-4, 2),
    ("roll", 3): (0.3599, 9.951e-4, 2),
    ("yaw", 3): (0.7430, 5.280e-4, 2),
}
"""(axis, samples of link delay): least disk margin, largest RMS of noise in the correction, least delay margin."""


def measure() -> Iterator[str]:
    """One row for each axis and delay."""
    spec = parse_spec(SPEC.read_text(encoding="utf-8"))
    blocks = {block.name: block for block in spec.blocks}
    yield "| axis, delay | weights searched | s | best, as modelled | states | best over the gains | states | s |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
    for (name, delay), limits in LIMITS.items():
        yield _row(replace(blocks[name], delay_samples=delay, disturbance=None, noise=None), spec.dt, limits)


def _row(block: BlockSpec, dt: float, limits: tuple[float, float, int]) -> str:
    plant, controller = (to_state_space(model, dt, (1, 1)) for model in (block.plant, block.controller))
    vehicle, rms = Vehicle(plant, controller, block.delay_samples), RMS[block.name]
    begun = time.process_time()
    searched = _searched(block, dt, limits)
    between = time.process_time()
    cells = [f"{block.name}, {block.delay_samples}"]
    cells += [_flown(vehicle, rms, searched) if searched else "none", f"{between - begun:.1f}"]
    axis = Axis.of(plant, controller, block.delay_samples, ATTITUDE_GAIN)
    search = Search(axis, Spectrum(LowPass(DISTURBANCE_HZ), rms))
    for gains in ((), (0.7, 1.3)):
        between = time.process_time()
        wanted = Wanted(
            disk_margin=limits[0], noise=limits[1], delay_margin=limits[2], noise_rms=NOISE_SIGMA, gains=gains
        )
        found = search.best(wanted)
        cells += [_flown(vehicle, rms, found.observer(axis)), str(found.order)] if found else ["none", ""]
    cells.append(f"{time.process_time() - between:.1f}")
    return f"| {' | '.join(cells)} |"


def _searched(block: BlockSpec, dt: float, limits: tuple[float, float, int]) -> Any:
    """The observer of the weights that the search chooses; None where it finds none."""
    auto = AutoSpec(
        low_hz=0.1 * DISTURBANCE_HZ,
        high_hz=3.0 * DISTURBANCE_HZ,
        corner_hz=DISTURBANCE_HZ,
        spectrum=LowPass(DISTURBANCE_HZ),
        noise_rms=NOISE_SIGMA,
        least_disk_margin=limits[0],
        largest_noise=limits[1],
        least_delay_margin=limits[2],
    )
    try:
        return from_data(searched_design(block, dt, auto)[0].observer, dt)
    except DobError:
        return None


def _flown(vehicle: Vehicle, rms: float, observer: Any) -> str:
    """Attenuation at three gains."""
    shown = []
    for gain in (0.7, 1.0, 1.3):
        there = vehicle.with_gain(gain)
        off, on = (expect(close(there, each), rms) for each in (no_observer(there.dt), observer))
        shown.append(f"{off.attitude / on.attitude:.1f}" if off and on else "unstable")
    return ", ".join(shown)

"""The paper's disturbance beside what is LQG-optimal: `python -m tests.scenarios.optimum [--write]` (docs/optimum.md).

Flights are in process, which gives a wire flight's numbers to the last bit (tests/sitl/campaign/test_wire.py) and knows
a link of no delay; expected values are those of the linear loop in the flights' own weather.
"""

import argparse
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from statistics import median

import numpy as np

from dob_companion.artifact import DobDesign, dumps
from dob_companion.comparison.shortfall import Shortfall, shortfall
from dob_companion.synthesis import design, parse_spec
from docs.shipped import EXAMPLES, SPECS
from sitl.calibration import disturbance_scale
from sitl.campaign.fleet import local
from sitl.campaign.pilot import Job
from sitl.campaign.plan import Inputs
from sitl.constants import AXES
from sitl.scenario.spec import load

DELAYS = (0, 1, 2, 3)
SEEDS = (1, 2, 3, 4, 5)
SCENARIOS = ("paper", "paper_nonlinear")
DESIGNS = ("paper", "tuned")

PROCESSES = 2

STRENGTHS = {"paper": (1.0,), "tuned": (1.0, 0.5)}
"""Shares of the scenario's disturbance that each design flies: what half of it changes tells what is not linear."""


@dataclass(frozen=True, slots=True)
class Case:
    """One axis of one design at one link delay in one scenario, its disturbance times `strength`."""

    scenario: str
    strength: float
    design: str
    delay: int
    axis: str


@dataclass(frozen=True, slots=True)
class Flown:
    """RMS attitude error, rad, observer off and on, one entry per seed."""

    off: tuple[float, ...]
    on: tuple[float, ...]

    @property
    def ratios(self) -> tuple[float, ...]:
        """RMS off / on."""
        return tuple(off / on for off, on in zip(self.off, self.on, strict=True))

    @property
    def ratio(self) -> float:
        """The median seed's."""
        return median(self.ratios)

    def above(self, attenuation: float) -> float:
        """Share by which the median seed's RMS exceeds that of an observer with this attenuation."""
        return attenuation / self.ratio - 1.0


@dataclass(frozen=True, slots=True)
class Found:
    """Everything on the page: flights, and the expected values by (design, delay, axis)."""

    flown: dict[Case, Flown]
    expected: dict[tuple[str, int, str], Shortfall]


@cache
def design_of(name: str, delay: int) -> DobDesign:
    """The paper's weights, or the tuned ones, solved for this delay."""
    path = EXAMPLES / ("tailsitter_paper.toml" if name == "paper" else SPECS[delay])
    spec = parse_spec(path.read_text("utf-8"), path.name)
    blocks = tuple(replace(block, delay_samples=delay, auto=None) for block in spec.blocks)
    return design(replace(spec, delay_samples=delay, blocks=blocks))


def find() -> Found:
    """Fly and compute; some minutes."""
    with ProcessPoolExecutor(PROCESSES) as pool:
        pairs = [(scenario, seed) for scenario in SCENARIOS for seed in SEEDS]
        scales = dict(zip(pairs, pool.map(_scale, pairs), strict=True))
        sigma = np.sqrt(np.mean([np.square(scales["paper", seed]) for seed in SEEDS], axis=0))
        keys = [(name, delay, axis) for name in DESIGNS for delay in DELAYS for axis in AXES]
        sizes = [float(sigma[AXES.index(axis)]) for _, _, axis in keys]
        expected = dict(zip(keys, pool.map(_shortfall, keys, sizes), strict=True))
    return Found(fly(scales), expected)


def fly(scales: dict[tuple[str, int], tuple[float, float, float]]) -> dict[Case, Flown]:
    """Every flight, by what it shows; `scales` are the disturbances of (scenario, seed)."""
    jobs: list[Job] = []
    strengths: list[float] = []
    for name in DESIGNS:
        for delay in DELAYS:
            text = dumps(design_of(name, delay))[0]
            for (scenario, seed), scale in scales.items():
                for strength in STRENGTHS[name]:
                    spec = load(scenario)
                    inputs = Inputs(len(jobs), seed, spec.airframe, name, delay, 1.0, 1.0)
                    roll, pitch, yaw = (strength * size for size in scale)
                    jobs.append(Job(inputs, spec, (roll, pitch, yaw), text, {}))
                    strengths.append(strength)
    rows = sorted((row for some in local(jobs, PROCESSES) for row in some), key=lambda row: row["flight"])
    flown: dict[Case, tuple[list[float], list[float]]] = {}
    for job, strength, row in zip(jobs, strengths, rows, strict=True):
        if row["outcome"] != "complete" or row["state"] != "ACTIVE" or row["delay_samples"] != job.inputs.delay:
            raise RuntimeError(f"{job.scenario.name}, {job.inputs}: {row['outcome']}, {row['reason']}")
        for axis in AXES:
            case = Case(job.scenario.name, strength, job.inputs.design, job.inputs.delay, axis)
            off, on = flown.setdefault(case, ([], []))
            off.append(row[f"rms_off_{axis}"])
            on.append(row[f"rms_on_{axis}"])
    return {case: Flown(tuple(off), tuple(on)) for case, (off, on) in flown.items()}


def _scale(pair: tuple[str, int]) -> tuple[float, float, float]:
    scenario, seed = pair
    return disturbance_scale(load(scenario), seed)


def _shortfall(key: tuple[str, int, str], sigma: float) -> Shortfall:
    name, delay, axis = key
    found = design_of(name, delay)
    block = next(block for block in found.blocks if block.axes == (axis,))
    return shortfall(block, found.dt, sigma)


def main(arguments: Iterable[str] | None = None) -> int:
    """Print the page."""
    from tests.scenarios.optimum_page import PAGE, page

    parser = argparse.ArgumentParser(prog="python -m tests.scenarios.optimum", description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help=f"into docs/{PAGE.name}")
    options = parser.parse_args(None if arguments is None else list(arguments))
    text = page(find())
    print(text)
    if options.write:
        PAGE.write_text(text, "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(import_module("tests.scenarios.optimum").main())  # whose Case is the one that the page looks up

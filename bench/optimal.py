"""The best observer of one axis beside a search among weights and beside its bound, at equal limits: attenuation, time.

Twenty axes (`_axes.py`). Searched is the family of weights that `design --auto` once chose from. Attenuation is the RMS
attitude error off / on in the axis' weather, gyro noise included, at 0.7, 1 and 1.3 of the plant's gain. The bound is
for every observer of any order, the plant as modelled; shares of it are those of the attenuation at 1. Delay margin and
slowest mode, which the observers keep, are not in it. Times are of one core.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import control as ct

from bench._axes import Case, cases
from bench._searched import searched_design
from dob_companion.errors import DobError
from dob_companion.synthesis.optimal.asked import spectrum_of, wanted_of
from dob_companion.synthesis.optimal.bound import attenuation_limit
from dob_companion.synthesis.optimal.problem import Axis, Block
from dob_companion.synthesis.optimal.reached import attenuation
from dob_companion.synthesis.optimal.search import MOST_ORDER, ORDER, Search, usual_order
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.models import from_data, to_state_space
from dob_companion.synthesis.plant.problem import Problem

GAINS = (0.7, 1.0, 1.3)

SEARCHED, ALONE, OVER = "searched weights", "best, as modelled", "best over the gains"
HEAD = ("axis, delay", SEARCHED, "s", "bound", ALONE, "of it", "states", OVER, "of it", "states", "s")


def measure() -> Iterator[str]:
    """One row for each axis."""
    yield f"| {' | '.join(HEAD)} |"
    yield f"|{' --- |' * len(HEAD)}"
    for case in cases():
        yield f"| {' | '.join(_cells(case))} |"


def _cells(case: Case) -> Iterator[str]:
    block, asked = case.block, case.asked
    plant, controller = (minimal(to_state_space(model, case.dt, (1, 1))) for model in (block.plant, block.controller))
    one = ct.ss([], [], [], [[1.0]], case.dt)
    problem = Problem(plant, controller, one, one, (block.delay_samples,))
    axis = Axis.of(plant, controller, block.delay_samples, asked.attitude_gain)
    spectrum = spectrum_of(asked)
    yield case.name
    begun = time.process_time()
    searched = _searched(case)
    yield _flown(problem, case, searched)
    yield f"{time.process_time() - begun:.1f}"
    wanted = wanted_of(asked, 1.0)
    bound = attenuation_limit(Block(plant, controller, problem.delays, asked.attitude_gain), spectrum, wanted)
    yield f"{bound:.2f}"
    for gains, order in (((), MOST_ORDER), (asked.gains, ORDER)):
        begun = time.process_time()
        found = Search(axis, spectrum, max(order, usual_order(axis))).best(replace(wanted, gains=gains))
        took = time.process_time() - begun
        observer = found.observer(axis) if found else None
        yield _flown(problem, case, observer)
        reached = attenuation(problem, observer, asked, spectrum) if found else None
        yield f"{100.0 * reached / bound:.1f} %" if reached else ""
        yield str(found.order) if found else ""
    yield f"{took:.1f}"


def _searched(case: Case) -> Any:
    """The observer of the weights that the search chooses; None where it finds none."""
    bare = replace(case.block, disturbance=None, noise=None, uncertainty=None, largest_order=None)
    try:
        return from_data(searched_design(bare, case.dt, case.asked).observer, case.dt)
    except DobError:
        return None


def _flown(problem: Problem, case: Case, observer: Any) -> str:
    """Attenuation at three gains."""
    if observer is None:
        return "none"
    spectrum = spectrum_of(case.asked)
    found = [attenuation(problem, observer, case.asked, spectrum, gain) for gain in GAINS]
    return ", ".join("unstable" if value is None else f"{value:.1f}" for value in found)

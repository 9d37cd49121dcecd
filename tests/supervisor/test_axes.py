"""The sign and axis check in flights of the simulated vehicle: silent when it is right, in time when it is not."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dob_companion.artifact import AXES, StateSpaceData, dumps
from dob_companion.supervisor import AxisCheck
from sitl.calibration import disturbance_scale
from sitl.campaign.pilot import Craft, Job
from sitl.campaign.plan import Inputs
from sitl.flight import Flight
from sitl.scenario.script import Phase
from sitl.scenario.spec import load, packaged_names
from tests.companion.aircraft import DT, small_design
from tests.scenarios.designs import design_for, design_named

STATED_S = 6.0
"""Of disturbed hover, within which an error is named."""

WORDS = ("inverted", "swapped", "scaled")


def flown_off(name, seed, seconds, scale=(0.0, 0.0, 0.0)):
    """Rates and moments, (N, 3) each, of the first seconds of a scenario without a companion."""
    flight = Flight(load(name), seed, scale)
    for _ in range(round(seconds / DT)):
        flight.step()
    assert flight.script.phase is Phase.OFF
    arrays = flight.log.arrays()
    return arrays["gyro"], arrays["u_e"]


def verdicts(y, u, check=None):
    """Everything that the check says, asked as often as the daemon asks it."""
    check = check or AxisCheck(design_for(1))
    said = set()
    for k, (rates, moment) in enumerate(zip(y.tolist(), u.tolist(), strict=True)):
        check.add(rates, moment)
        if k % 25 == 24:
            said.update(check.errors())
    return said


@pytest.mark.parametrize(("name", "seed", "seconds"), [("gust", 1, 34.0), ("dryden", 2, 14.0)])
def test_gusts_and_turbulence_that_the_position_hold_leans_into_are_no_error(name, seed, seconds):
    assert verdicts(*flown_off(name, seed, seconds)) == set()


@pytest.fixture(scope="module")
def hover():
    """Seconds of a disturbed hover."""
    y, u = flown_off("paper", 1, 14.0, scale=(0.1, 0.1, 0.1))
    last = round(STATED_S / DT)
    return y[-last:], u[-last:]


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda y, u: (y * [1, -1, 1], u), {"pitch is inverted"}),
        (lambda y, u: (y, u * [-1, 1, -1]), {"roll is inverted", "yaw is inverted"}),
        (lambda y, u: (y[:, [1, 0, 2]], u), {"roll is swapped with pitch", "pitch is swapped with roll"}),
        (lambda y, u: (y[:, [1, 0, 2]] * [1, -1, 1], u), {"roll is swapped with pitch", "pitch is swapped with roll"}),
        (lambda y, u: (y[:, [2, 1, 0]], u), {"roll is swapped with yaw", "yaw is swapped with roll"}),
        (
            lambda y, u: (y[:, [1, 2, 0]], u),
            {"roll is swapped with yaw", "pitch is swapped with roll", "yaw is swapped with pitch"},
        ),
        (lambda y, u: (np.degrees(y), u), {f"{axis} is scaled by" for axis in AXES}),
        (lambda y, u: (y, u * [1, 1, 10]), {"yaw is scaled by"}),
        (lambda y, u: (y, u), set()),
    ],
    ids=[
        "pitch",
        "roll and yaw",
        "roll and pitch",
        "turned by 90°",
        "roll and yaw",
        "all three",
        "deg/s",
        "Nm",
        "right",
    ],
)
def test_every_true_error_is_named_within_the_stated_time(hover, spoil, expected):
    said = verdicts(*spoil(*hover))
    assert {re.sub(r"(?<=scaled by) .*", "", words) for words in said} == expected


def test_the_noise_that_the_controller_answers_shows_a_sign_but_no_swap():
    y, u = flown_off("paper", 1, 8.0)
    y, u = y[-1000:], u[-1000:]
    assert verdicts(y * [-1, 1, -1], u) == {"roll is inverted", "yaw is inverted"}
    assert verdicts(y[:, [2, 1, 0]], u) == set()


def test_blocks_that_a_gap_cuts_short_do_not_count_and_whole_ones_are_kept(hover):
    y, u = hover
    check = AxisCheck(design_for(1))
    for cut in (120, 124, 100):
        assert verdicts(-y[:cut], u[:cut], check) == set()
        check.interrupt()
        assert not check.ready
    for begin in range(0, 750, 125):
        verdicts(-y[begin : begin + 125], u[begin : begin + 125], check)
        check.interrupt()
    assert len(check.errors()) == 3
    check.clear()
    assert check.errors() == []


def test_an_axis_without_any_motion_is_unproven_and_no_error():
    check = AxisCheck(small_design(axes=("roll", "pitch")))
    assert verdicts(np.zeros((1000, 3)), np.full((1000, 3), 0.3), check) == set()
    assert check.unproven() == ["roll", "pitch"]


def test_a_plant_that_is_unstable_by_itself_is_judged_by_its_moments():
    design = small_design(axes=("roll",))
    (block,) = design.blocks
    plant = StateSpaceData([[1.5]], [[1.0]], [[1.0]], [[0.0]])
    design = replace(design, blocks=(replace(block, problem=replace(block.problem, plant=plant)),))
    y = np.random.default_rng(1).normal(0.0, 0.1, (10_000, 3))
    assert verdicts(y, -0.1 * y, check := AxisCheck(design)) == set()
    assert check.unproven() == []
    assert verdicts(y[:2000], 0.1 * y[:2000], AxisCheck(design)) == {"roll is inverted"}


@pytest.mark.proof
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", [name for name in packaged_names() if load(name).windows])
def test_no_scenario_raises_an_alarm(name, seed):
    """With the whole flight watched (no axis is injected on) and with each design at work at its own link delay."""
    scenario = load(name)
    scale = disturbance_scale(scenario, seed)
    for spec, delay, parameters in (
        ("tailsitter_tuned.toml", 1, {"DOB_AXES": 0.0}),
        ("tailsitter_paper.toml", 1, {}),
        ("tailsitter_tuned.toml", 1, {}),
        ("tailsitter_tuned_2.toml", 2, {}),
        ("tailsitter_tuned_3.toml", 3, {}),
    ):
        inputs = Inputs(0, seed, scenario.airframe, spec, delay, 1.0, 1.0)
        craft = Craft(Job(inputs, scenario, scale, dumps(design_named(spec))[0], parameters))
        while not craft.flight.complete:
            craft.step()
            assert not any(word in craft.onboard.why for word in WORDS), (spec, delay, craft.onboard.why)

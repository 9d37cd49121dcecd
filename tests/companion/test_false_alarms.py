"""No gust, payload, failure or manoeuvre of the simulated vehicle is taken for a loop that rings."""

from dataclasses import replace
from functools import cache

import pytest

from dob_companion.artifact import dumps
from sitl.calibration import disturbance_scale
from sitl.campaign.pilot import Craft, Job
from sitl.campaign.plan import Inputs
from sitl.errors import FlightFailedError
from sitl.scenario.script import Phase
from sitl.scenario.spec import AIRFRAMES, load, packaged_names
from tests.scenarios.designs import design_for, design_named

HOVER_SAMPLES = 15_000
"""A scenario without windows is flown for a minute of hover, switched on."""

FLOWN = [
    (name, airframe)
    for name in packaged_names()
    for airframe in AIRFRAMES
    if not replace(load(name), airframe=airframe).lacks_body
]

_scales = {}


@cache
def design():
    return dumps(design_for(1))[0]


def scale_of(scenario):
    """The disturbance's size, found once for all scenarios that ask for the same."""
    asked = (scenario.airframe, scenario.disturbance)
    if asked not in _scales:
        _scales[asked] = disturbance_scale(scenario, 1)
    return _scales[asked]


def flown(name, airframe, seed, scale=None, text=None):
    """The craft at the end of the flight, or when it came down. A fault stays until it is switched off.

    `text`: of the design.json that flies."""
    scenario = replace(load(name), airframe=airframe)
    inputs = Inputs(0, seed, airframe, "tuned", 1, 1.0, 1.0)
    craft = Craft(Job(inputs, scenario, scale or scale_of(scenario), text or design(), {}))
    hovered = 0
    try:
        while not craft.flight.complete and hovered < HOVER_SAMPLES:
            craft.step()
            if craft.flight.script.phase is Phase.HOVER:
                if not hovered:
                    craft.onboard.write("DOB_ENABLE", 1.0)
                hovered += 1
    except FlightFailedError as end:
        craft.failure = str(end)
    return craft


def test_manoeuvres_are_not_taken_for_ringing():
    craft = flown("aggressive", "linear", seed=1)
    assert craft.failure == ""
    assert "rings" not in craft.onboard.why


@pytest.mark.proof
def test_three_times_a_scenario_s_disturbance_is_not_taken_for_ringing():
    assert "rings" not in flown("battery", "linear", seed=2, scale=(0.05, 0.05, 0.05)).onboard.why


@pytest.mark.proof
@pytest.mark.parametrize("seed", range(1, 31))
def test_the_papers_own_design_on_its_own_plant_is_not_taken_for_ringing(seed):
    """Strong wind that begins at once after ten seconds of still air; seed 8 was taken for ringing once."""
    text = dumps(design_named("tailsitter_paper.toml"))[0]
    assert flown("paper", "linear", seed, text=text).onboard.why == ""


@pytest.mark.proof
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("name", "airframe"), FLOWN)
def test_no_scenario_is_taken_for_ringing(name, airframe, seed):
    """More than two hours of flight, half of them switched on."""
    assert "rings" not in flown(name, airframe, seed).onboard.why

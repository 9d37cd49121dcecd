"""The nonlinear tail-sitter, swept through MAVLink: the paper's pitch model, and the models of the linear axes."""

import numpy as np
import pytest

from sitl.airframe.linear import PITCH, ROLL, YAW
from sitl.constants import AXES
from sitl.sweep.client import SweepClient
from sitl.sweep.fit import response_of
from sitl.sweep.identify import Identified, acceleration, identify, modes
from sitl.sweep.multisine import FLEXIBLE, Plan, excitation
from sitl.tailsitter.parameters import Parameters
from sitl.tailsitter.trim import linearize
from tests.sitl.sweep.memory import fly, vehicle


def swept(axis: str, plan: Plan, flexible: bool = False) -> Identified:
    client = SweepClient([(AXES.index(axis), excitation(plan, 1))])
    fly(client, vehicle("tailsitter", flexible))
    return identify(axis, plan, client.records[0])


def misfit(found: Identified, model: np.ndarray, low: float, high: float) -> float:
    """Largest relative difference of the measured response from `model` between two frequencies, rad/s."""
    w = found.response.frequency
    inside = (w >= low) & (w <= high)
    return float(np.abs(found.response.value / model - 1.0)[inside].max())


def test_pitch_is_the_papers_model():
    found = swept("pitch", Plan(realizations=3, lead=2000))
    w, model = found.response.frequency, found.fit.model
    assert misfit(found, response_of(PITCH, w), 4.0, 50.0) < 0.03
    assert misfit(found, linearize(Parameters()).response(w, 1), 7.0, 100.0) < 0.015
    assert acceleration(model) == pytest.approx(acceleration(PITCH), rel=0.01)
    assert model.zero == pytest.approx(PITCH.zero, abs=0.1)
    assert model.pole == pytest.approx(PITCH.pole, abs=1e-3)


@pytest.mark.proof
@pytest.mark.parametrize(("axis", "model"), [("roll", ROLL), ("yaw", YAW)])
def test_the_linear_axes_are_the_tail_sitters(axis, model):
    found = swept(axis, Plan())
    w = found.response.frequency
    assert misfit(found, response_of(model, w), 4.0, 50.0) < 0.03
    assert misfit(found, linearize(Parameters()).response(w, AXES.index(axis)), 2.0, 50.0) < 0.03
    assert acceleration(found.fit.model) == pytest.approx(acceleration(model), rel=0.02)
    assert found.fit.model.zero == pytest.approx(model.zero, abs=0.05)


@pytest.mark.proof
def test_the_three_flexible_modes_of_pitch_are_seen_where_they_are():
    found = swept("pitch", FLEXIBLE, flexible=True)
    frequencies = [frequency for frequency, _ in modes(found)]
    assert frequencies == pytest.approx(Parameters().mode_frequency, rel=0.05)
    assert misfit(found, response_of(PITCH, found.response.frequency), 7.0, 50.0) < 0.06

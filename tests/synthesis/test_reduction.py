"""Observers of lower order: still deaf to commands, with a stated error, certified anew or refused with the numbers."""

import re

import control as ct
import numpy as np
import pytest

from bench._plants import all_plants
from dob_companion.cli.main import main
from dob_companion.errors import NotCertifiedError, NotConvergedError, SpecError
from dob_companion.lti.response import gains, spectral_radius
from dob_companion.synthesis import parse_spec, synthesize
from dob_companion.synthesis.certify.reduction import projection
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.problem import Problem
from tests.synthesis.paper import PID, PLANT, SPEC, W_D, W_N

PLANTS = {plant.name: plant for plant in all_plants()}


@pytest.fixture(scope="module")
def full():
    return synthesize(PLANT, PID, W_D, W_N)


@pytest.fixture(scope="module")
def smaller():
    return synthesize(PLANT, PID, W_D, W_N, largest_order=3)


def test_a_reduced_observer_has_the_order_asked_for_and_keeps_its_proof(smaller):
    proof = smaller.certificate
    assert smaller.observer.nstates == 3
    assert proof.extra["reduced_from"] == 4
    assert proof.gamma_star <= proof.gamma <= 1.01 * proof.gamma_star
    assert proof.command_leak < 1e-9
    assert not np.any(smaller.observer.D[:, 1:])


def test_the_stated_error_is_not_below_the_hankel_floor(smaller):
    extra = smaller.certificate.extra
    assert 0.0 < extra["reduction_error_floor"] <= extra["reduction_error"]


def test_an_observer_that_is_not_stable_has_no_projection(full):
    """Its Gramian does not exist; the sum for it does not end."""
    D = full.observer
    unstable = ct.ss(1.1 / spectral_radius(D.A) * D.A, D.B, D.C, D.D, D.dt)
    with pytest.raises(NotConvergedError, match="system of order 4 does not come to rest"):
        projection(full.problem, unstable)


def test_the_norm_of_the_difference_is_what_a_frequency_grid_shows(full):
    problem = full.problem
    reduced = projection(problem, full.observer).of_order(3)
    difference = full.observer - reduced
    on_grid = np.max(gains(difference, np.linspace(0.0, np.pi, 5000)))
    assert hinf_norm(difference)[0] == pytest.approx(on_grid, rel=1e-3)


@pytest.mark.parametrize("name", ["three axes, coupled", "direct feedthrough", "paper pitch, three flexible modes"])
def test_no_command_leaks_and_nothing_is_unstable_at_any_order(name):
    plant = PLANTS[name]
    m = plant.plant.D.shape[1]
    found = synthesize(*plant.arguments, delay_samples=plant.delay)
    problem = Problem(*plant.arguments, (plant.delay,) * m)
    directions = projection(problem, found.observer)
    assert 0 < directions.least < found.observer.nstates
    for order in range(directions.least, found.observer.nstates + 1):
        reduced = directions.of_order(order)
        loop = close_loop(problem.plant, problem.controller, reduced, problem.delays)
        assert spectral_radius(reduced.A) < 1.0
        assert hinf_norm(loop.part("d_hat", "w_r"))[0] < 1e-8


def test_the_projection_onto_all_directions_is_the_observer_itself(full):
    whole = projection(full.problem, full.observer).of_order(full.observer.nstates)
    assert hinf_norm(whole - full.observer)[0] < 1e-9 * hinf_norm(full.observer)[0]


def test_an_order_that_is_large_enough_changes_nothing(full):
    same = synthesize(PLANT, PID, W_D, W_N, largest_order=4)
    assert np.array_equal(same.observer.A, full.observer.A)
    assert "reduced_from" not in same.certificate.extra


def test_an_order_that_costs_too_much_is_refused_with_gamma_and_the_smallest_that_does():
    with pytest.raises(NotCertifiedError) as refusal:
        synthesize(PLANT, PID, W_D, W_N, largest_order=2)
    words = str(refusal.value)
    measured, allowed = (float(x) for x in re.findall(r"(?:gamma|at most) (\d+\.\d+)", words))
    assert measured > allowed == pytest.approx(1.01 * 1.59982, rel=1e-4)
    assert "the smallest order that does is 3" in words


def test_an_order_below_the_plants_is_refused_since_it_would_hear_commands():
    with pytest.raises(NotCertifiedError, match=r"order 1 cannot be deaf to commands, which takes 2 states"):
        synthesize(PLANT, PID, W_D, W_N, largest_order=1)


def test_a_block_overrides_the_designs_largest_order():
    text = SPEC.read_text(encoding="utf-8").replace("[design]", "[design]\nlargest_order = 3")
    text = text.replace('axes = ["roll"]', 'axes = ["roll"]\nlargest_order = 5')
    assert {block.name: block.largest_order for block in parse_spec(text).blocks} == {"pitch": 3, "roll": 5, "yaw": 3}


@pytest.mark.parametrize("order", ["0", "-1", "2.5", "true"])
def test_an_order_that_is_no_count_is_refused(order):
    text = SPEC.read_text(encoding="utf-8").replace("[design]", f"[design]\nlargest_order = {order}")
    with pytest.raises(SpecError, match="largest_order: expected a whole number"):
        parse_spec(text)


def test_design_refuses_an_order_from_the_command_line_in_one_line(tmp_path, capsys):
    assert main(["design", str(SPEC), "-o", str(tmp_path / "out"), "--order", "2"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "block 'pitch'" in line
    assert "smallest order that does is 3" in line
    assert not (tmp_path / "out").exists()

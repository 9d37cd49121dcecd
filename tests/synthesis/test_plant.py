"""The estimation form against the closed loop that it stands for."""

import numpy as np
import pytest

from dob_companion.lti.response import response
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.estimation import delay, estimation_problem
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.solve.riccati import central_filter
from dob_companion.synthesis.solve.scaling import whitened
from tests.synthesis import paper
from tests.synthesis.problems import random_plant, random_problem, static

ANGLES = np.linspace(0.01, 3.1, 60)


def filter_of(problem, gamma=1.5):
    white = whitened(problem)
    found = central_filter(white.problem, gamma)
    return white.gains(found.K, found.K_z)


@pytest.mark.parametrize(
    ("p", "m", "delays"), [(1, 1, (0,)), (1, 1, (3,)), (2, 2, (1, 1)), (2, 2, (0, 2)), (3, 2, (2, 1))]
)
@pytest.mark.parametrize("feedthrough", [0.0, 0.5])
def test_estimation_error_and_closed_loop_error_have_the_same_norm(p, m, delays, feedthrough):
    plant, controller, W_d, W_n = random_problem(p + 10 * m, p, m, feedthrough=feedthrough)
    posed = estimation_problem(plant, W_d, W_n, delays)
    gains = filter_of(posed)
    loop = close_loop(plant, controller, posed.observer(*gains), delays)
    closed = loop.part("error", "d", "n") * stack([W_d, W_n])
    assert hinf_norm(closed)[0] == pytest.approx(hinf_norm(posed.error_system(*gains))[0], rel=1e-7)


def test_a_coupled_disturbance_weight_over_unequal_delays_is_advanced_as_a_whole():
    rng = np.random.default_rng(4)
    plant, controller, _, W_n = random_problem(4, 2, 2)
    W_d = random_plant(rng, 3, 2, 2, feedthrough=1.0)
    posed = estimation_problem(plant, W_d, W_n, (0, 2))
    assert len(posed.A) == plant.nstates + W_d.nstates + W_n.nstates + 4
    gains = filter_of(posed)
    loop = close_loop(plant, controller, posed.observer(*gains), (0, 2))
    closed = loop.part("error", "d", "n") * stack([W_d, W_n])
    assert hinf_norm(closed)[0] == pytest.approx(hinf_norm(posed.error_system(*gains))[0], rel=1e-7)


def test_order_is_plant_weights_and_one_state_for_each_sample_of_delay():
    for tau in range(4):
        assert len(estimation_problem(paper.PLANT, paper.W_D, paper.W_N, (tau,)).A) == 4 + tau


def test_the_observer_is_command_invariant_by_construction():
    """D_y G + D_u = 0 for any gains whatever, not only for good ones."""
    rng = np.random.default_rng(0)
    posed = estimation_problem(paper.PLANT, paper.W_D, paper.W_N, (1,))
    observer = posed.observer(rng.normal(size=(5, 1)), rng.normal(size=(1, 1)))
    D, G = response(observer, ANGLES), response(paper.PLANT, ANGLES)
    assert np.max(np.abs(D[:, :, :1] @ G + D[:, :, 1:])) < 1e-9 * np.max(np.abs(D))


def test_the_loop_without_observer_is_the_baseline():
    loop = close_loop(paper.PLANT, paper.PID, None, (1,))
    G, C = (response(s, ANGLES)[:, 0, 0] for s in (paper.PLANT, paper.PID))
    assert response(loop.part("y", "d"), ANGLES)[:, 0, 0] == pytest.approx(G / (1 + G * C), rel=1e-10)
    assert response(loop.part("u_e", "n"), ANGLES)[:, 0, 0] == pytest.approx(-C / (1 + G * C), rel=1e-10)


def test_the_loop_subtracts_the_delayed_estimate():
    """With d_hat = y_n and no controller: y = G (d - z^-2 y_n)."""
    observer = static([[1.0, 0.0]])
    loop = close_loop(paper.PLANT, static(0.0), observer, (2,))
    G, late = response(paper.PLANT, ANGLES)[:, 0, 0], np.exp(-2j * ANGLES)
    assert response(loop.part("y", "d"), ANGLES)[:, 0, 0] == pytest.approx(G / (1 + late * G), rel=1e-10)
    assert response(loop.part("error", "n"), ANGLES)[:, 0, 0] == pytest.approx(-late / (1 + late * G), rel=1e-10)


def test_delays_are_whole_samples_on_each_channel():
    expected = np.exp(-1j * np.outer(ANGLES, [0, 3]))
    got = response(delay((0, 3), 0.004), ANGLES)
    assert got[:, [0, 1], [0, 1]] == pytest.approx(expected)
    assert not np.any(got[:, 0, 1])

"""A disturbance weight with a zero where the plant neither grows nor decays: the problem is solved, not refused."""

import control as ct
import numpy as np
import pytest

from dob_companion.lti.response import gains
from dob_companion.synthesis import synthesize, zpk
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import stack
from tests.synthesis import paper

BAND = zpk([1.0, -0.9], [0.99, 0.9], 0.05, paper.DT)
TURN = np.exp(0.1j)
OSCILLATOR = ct.ss(ct.tf([0.1], [1.0, -2.0 * TURN.real, 1.0], paper.DT))
DAMPER = ct.ss(ct.tf([0.1, -0.1], [1.0, 0.0], paper.DT))


def solved(W_d, plant=paper.PLANT, controller=paper.PID, W_n=paper.W_N, **options):
    result = synthesize(plant, controller, W_d, W_n, **options)
    proof = result.certificate
    assert proof.gamma_star <= proof.gamma <= proof.gamma_backoff * proof.gamma_star
    assert proof.observer_spectral_radius < 1.0
    assert proof.command_leak < 1e-6
    return result


@pytest.mark.parametrize("backoff", [1.01, 1.001])
def test_an_integrator_under_a_weight_without_steady_gain_is_solved(backoff):
    result = solved(BAND, gamma_backoff=backoff)
    problem = result.problem
    loop = close_loop(problem.plant, problem.controller, result.observer, problem.delays)
    error = loop.part("error", "d", "n") * stack([problem.disturbance_weight, problem.noise_weight])
    on_grid = np.max(gains(error, np.geomspace(1e-7, np.pi, 20000)))  # into the slow mode's own frequencies
    assert on_grid <= result.certificate.gamma * (1.0 + 1e-9)


def test_gamma_star_is_what_it_tends_to_as_the_zero_comes_near():
    there = solved(BAND).certificate.gamma_star
    for away in (1e-3, 1e-4):
        near = solved(zpk([1.0 - away, -0.9], [0.99, 0.9], 0.05, paper.DT)).certificate.gamma_star
        assert near == pytest.approx(there, rel=5.0 * away)


def test_gamma_star_does_not_depend_on_whether_the_plant_integrates():
    """Of a weight that leaves the integrator at rest; a leaky integrator has nothing at rest."""
    leaky = zpk([-1.716], [1.0 - 1e-5, 0.9447], 0.14131, paper.DT)
    exact, near = solved(BAND).certificate, solved(BAND, plant=leaky).certificate
    assert near.gamma_star == pytest.approx(exact.gamma_star, rel=1e-4)


@pytest.mark.parametrize(
    ("W_d", "plant", "controller"),
    [
        (zpk([1.0], [0.5], 1.0, paper.DT), zpk([-0.9], [1.0, 1.0], 1e-3, paper.DT), zpk([0.98], [0.5], 0.5, paper.DT)),
        (
            zpk([1.0, 1.0], [0.9, 0.9], 1.0, paper.DT),
            zpk([-0.9], [1.0, 1.0], 1e-3, paper.DT),
            zpk([0.98], [0.5], 0.5, paper.DT),
        ),
        (zpk([TURN, TURN.conjugate()], [0.5, 0.5], 1.0, paper.DT), OSCILLATOR, DAMPER),
    ],
    ids=["double integrator, one zero", "double integrator, two zeros", "oscillator"],
)
def test_other_undamped_modes_at_rest_are_solved(W_d, plant, controller):
    solved(W_d, plant=plant, controller=controller)


def test_one_axis_at_rest_beside_one_that_is_not():
    plant, controller = ct.append(paper.PLANT, paper.PLANT), ct.append(paper.PID, paper.PID)
    both = solved(ct.append(BAND, paper.W_D), plant, controller, ct.append(paper.W_N, paper.W_N)).certificate
    alone = (solved(W_d).certificate.gamma_star for W_d in (BAND, paper.W_D))
    assert both.gamma_star == pytest.approx(max(alone), rel=1e-4)

"""Lower bounds of gamma_star hold whatever numbers they are made from, and a solver that stalls refuses nothing."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench._plants import all_plants
from dob_companion.lti.response import response
from dob_companion.synthesis import synthesize, zpk
from dob_companion.synthesis.plant.estimation import estimation_problem
from dob_companion.synthesis.plant.models import discretize, polynomial
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.solve import optimum
from dob_companion.synthesis.solve.dual import lower_bound
from dob_companion.synthesis.solve.optimum import find_optimum
from dob_companion.synthesis.solve.riccati import bracket_gamma_star
from dob_companion.synthesis.solve.scaling import whitened
from tests.effort import examples
from tests.synthesis import paper
from tests.synthesis.nehari import Nehari
from tests.synthesis.problems import random_problem

FAST = 0.0025  # 400 Hz
LAG = 10.0 * np.pi
W_D, W_N = ([-0.8997], [0.9962], 0.19908), ([0.9949], [-0.925], 3.7584)


def lags(count):
    """(10 pi)^n / (s + 10 pi)^n from its coefficients."""
    return discretize(polynomial([LAG**count], np.real(np.poly([-LAG] * count)), 0.0), FAST, "zoh")


def problem_of_lags(count):
    none = ct.ss([], [], [], [[0.0]], FAST)
    return Problem(lags(count), none, zpk(*W_D, FAST), zpk(*W_N, FAST), (1,))


@pytest.fixture(scope="module", params=["paper", "coupled", "two gyros"])
def white(request):
    if request.param == "two gyros":
        plant = next(plant for plant in all_plants() if plant.name == "two gyros, one moment")
        return whitened(estimation_problem(plant.plant, plant.disturbance, plant.noise, (plant.delay,))).problem
    if request.param == "paper":
        return whitened(estimation_problem(paper.PLANT, paper.W_D, paper.W_N, (1,))).problem
    plant, _, W_d, W_n = random_problem(1, 2, 2)
    return whitened(estimation_problem(plant, W_d, W_n, (1, 0))).problem


@pytest.fixture(scope="module")
def reached(white):
    return bracket_gamma_star(white, 1.0)[1]


@given(seed=st.integers(0, 10**6), rank=st.integers(1, 4), size=st.floats(-3, 3))
@settings(max_examples=examples(40), deadline=None, derandomize=True)
def test_no_multiplier_proves_more_than_is_true(white, reached, seed, rank, size):
    rng = np.random.default_rng(seed)
    n, q = white.B.shape
    half = rng.normal(size=(n + q, rank)) * np.concatenate([np.full(n, 10.0**size), np.ones(q)])[:, None]
    assert lower_bound(white, half @ half.T) <= reached * (1 + 1e-6)


@pytest.mark.parametrize("harm", [1e-6, 1e-3, 1e-1])
def test_a_spoilt_multiplier_proves_less_and_never_more(white, harm, monkeypatch):
    kept = []
    monkeypatch.setattr(
        "dob_companion.synthesis.solve.lmi.lower_bound", lambda p, J: kept.append(J) or lower_bound(p, J)
    )
    solution = optimum.solve_lmi(white)
    low, reached = bracket_gamma_star(white, 1.0)
    assert solution.dual_bound == pytest.approx(low, rel=1e-5)
    J, rng = kept[0], np.random.default_rng(0)
    noise = rng.normal(size=J.shape) * harm * np.max(np.abs(J))
    assert 0.0 <= lower_bound(white, J + noise + noise.T) <= reached * (1 + 1e-6)


@pytest.mark.parametrize("count", [2, 5, 8])
def test_chains_of_lags_given_by_their_coefficients_are_solved_twice_and_agree_with_nehari(count):
    problem = problem_of_lags(count)
    found = find_optimum(problem)
    assert found.method == optimum.BOTH
    weights = [at(system) for system in (problem.disturbance_weight, problem.noise_weight)]
    assert Nehari(sampled_lags(count), *weights, 1).agrees(found.gamma_star, 1e-5)


def sampled_lags(count):
    """The same from its roots: a cascade, never through coefficients."""
    return at(discretize(zpk([], [-LAG] * count, LAG**count, 0.0), FAST, "zoh"))


def at(system):
    return lambda z: response(system, np.angle(z))[:, 0, 0]


def test_a_chain_of_eight_lags_is_sampled_to_twelve_digits():
    z = np.exp(1j * np.array([0.0, 1e-3, 0.1, 0.5]))
    assert response(lags(8), np.angle(z))[:, 0, 0] == pytest.approx(sampled_lags(8)(z), rel=1e-12)


@pytest.mark.parametrize("factor", [6.3, 1.01, 0.5, 0.0])
def test_a_dual_that_is_refuted_or_weak_does_not_refuse_the_plant(factor, monkeypatch):
    """Above what was measured as reached, or far below: the Riccati equation stands alone, and its level is right."""
    expected = find_optimum(problem_of_lags(2)).gamma_star
    solve = optimum.solve_lmi

    def stalled(problem):
        found = solve(problem)
        return replace(found, dual_bound=factor * found.dual_bound, K=0.5 * found.K)

    monkeypatch.setattr(optimum, "solve_lmi", stalled)
    found = find_optimum(problem_of_lags(2))
    assert found.method == optimum.WEAK
    assert found.gamma_star == pytest.approx(expected, rel=1e-5)


def test_infeasible_levels_that_the_lmis_own_observer_reaches_are_not_believed(monkeypatch):
    """A Riccati equation that fails where a solution exists would make gamma_star too high, and its proof false."""
    expected = find_optimum(problem_of_lags(2)).gamma_star
    bracket = optimum.bracket_gamma_star
    monkeypatch.setattr(
        optimum, "bracket_gamma_star", lambda problem, guess: tuple(1.1 * level for level in bracket(problem, guess))
    )
    found = find_optimum(problem_of_lags(2))
    assert found.method == optimum.LMI
    assert found.gamma_star == pytest.approx(expected, rel=1e-5)


@st.composite
def vehicles(draw):
    """Rate loops as identification finds them: lags, perhaps an integrator, a mode and a right-half-plane zero."""
    lag = st.floats(-1.5, -0.02)
    poles = [np.exp(draw(lag)) for _ in range(draw(st.integers(1, 4)))]
    zeros = []
    if draw(st.booleans()):
        mode = draw(st.floats(0.95, 0.999)) * np.exp(1j * draw(st.floats(0.2, 2.5)))
        poles += [mode, mode.conjugate()]
        zeros += [draw(st.sampled_from([-1.5, 1.5, 0.5]))]
    gain = 10.0 ** draw(st.floats(-3, 1))
    plant = zpk(zeros, poles, gain * np.abs(np.prod(1 - np.array(poles))), paper.DT)
    W_d = zpk([-0.9], [1 - 10.0 ** draw(st.floats(-3.0, -1.5))], 0.1, paper.DT)
    W_n = zpk([draw(st.floats(0.5, 0.99))], [draw(st.floats(-0.9, 0.5))], 10.0 ** draw(st.floats(-1, 1)), paper.DT)
    return plant, W_d, W_n, draw(st.integers(0, 3))


@given(vehicles())
@settings(max_examples=8, deadline=None, derandomize=True)
def test_the_optimum_of_random_vehicles_is_neharis(problem):
    plant, W_d, W_n, delay = problem
    none = ct.ss([], [], [], [[0.0]], paper.DT)
    found = find_optimum(Problem(plant, none, W_d, W_n, (delay,)))
    levels = Nehari(*map(at, (plant, W_d, W_n)), delay)
    assert levels.agrees(found.gamma_star, 2e-5)  # a lower bound, and a near one
    proof = synthesize(plant, none, W_d, W_n, delay_samples=delay).certificate
    assert not levels.is_reached(proof.gamma / 1.01 / (1 + 2e-5))


def test_an_optimum_that_one_frequency_alone_forbids_to_better_is_found():
    """Where the plant moves little, gamma_star is the largest |W_d W_n / V|: at zero frequency, and known exactly."""
    plant, W_d, W_n = (
        ct.ss(*entries, paper.DT)
        for entries in ((0.36787944, 1, 0.00632121, 0), (0.99, 0.1, 1.89, 0.1), (0, 1, -0.5, 1))
    )
    found = find_optimum(Problem(plant, ct.ss([], [], [], [[0.0]], paper.DT), W_d, W_n, (0,)))
    G, d, n = (float(at(system)(np.ones(1))[0].real) for system in (plant, W_d, W_n))
    assert found.gamma_star == pytest.approx(d * n / np.hypot(G * d, n), rel=1e-6)
    assert Nehari(*map(at, (plant, W_d, W_n)), 0).agrees(found.gamma_star, 1e-5)

"""gamma_star from two algorithms of ours and from SLICOT's SB10AD, which shares no line with them."""

import numpy as np
import pytest

from dob_companion.synthesis import synthesize
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.estimation import estimation_problem
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.solve.lmi import solve_lmi
from dob_companion.synthesis.solve.optimum import candidates, find_optimum
from dob_companion.synthesis.solve.riccati import bracket_gamma_star, central_filter
from dob_companion.synthesis.solve.scaling import whitened
from tests.synthesis import paper
from tests.synthesis.problems import random_problem, static

pytest.importorskip("slycot")
from tests.effort import a_few
from tests.synthesis import oracle


def paper_problem(tau):
    return estimation_problem(paper.PLANT, paper.W_D, paper.W_N, (tau,))


@pytest.mark.parametrize("tau", [0, 1, 2, 3])
def test_lmi_riccati_and_slicot_agree_on_the_papers_plant(tau):
    white = whitened(paper_problem(tau))
    low, high = bracket_gamma_star(white.problem, 1.0)
    solution = solve_lmi(white.problem)
    expected = oracle.gamma_star(paper.PLANT, 0.1, paper.W_D, paper.W_N, (tau,))
    assert white.level * low == pytest.approx(expected, rel=1e-5)
    assert high <= low * (1 + 2e-6)
    assert solution.dual_bound == pytest.approx(low, rel=1e-5)
    assert solution.gamma == pytest.approx(low, rel=1e-5)


@pytest.mark.parametrize("gain", [0.02, 0.1, 0.2])
def test_the_optimum_does_not_depend_on_the_baseline_controller(gain):
    """SLICOT solves the closed loop with each gain; ours never sees the controller."""
    ours = find_optimum(Problem(paper.PLANT, paper.PID, paper.W_D, paper.W_N, (1,))).gamma_star
    assert oracle.gamma_star(paper.PLANT, gain, paper.W_D, paper.W_N, (1,)) == pytest.approx(ours, rel=1e-4)


@pytest.mark.parametrize("seed", a_few(range(3), every=3))
@pytest.mark.parametrize(("p", "m", "delays"), [(1, 1, (2,)), (2, 2, (1, 0)), (3, 2, (1, 2)), (1, 2, (1, 1))])
def test_all_three_agree_on_random_plants(seed, p, m, delays):
    plant, controller, W_d, W_n = random_problem(seed, p, m)
    optimum = find_optimum(Problem(plant, controller, W_d, W_n, delays))
    expected = oracle.gamma_star(plant, 0.0, W_d, W_n, delays)
    assert optimum.gamma_star == pytest.approx(expected, rel=1e-3)
    assert optimum.gamma_star <= expected * (1 + 1e-4)


@pytest.mark.parametrize("backoff", [1.01, 1.001])
def test_the_central_observer_stays_within_the_backoff_asked_for(backoff):
    for seed in range(4):
        plant, controller, W_d, W_n = random_problem(seed, 2, 2)
        optimum = find_optimum(Problem(plant, controller, W_d, W_n, (1, 1)))
        observer = next(candidates(optimum, backoff))
        assert observer.nstates == len(optimum.problem.A)
        found = central_filter(optimum.white.problem, backoff * optimum.gamma_star / optimum.white.level)
        norm = hinf_norm(optimum.problem.error_system(*optimum.white.gains(found.K, found.K_z)))[0]
        assert optimum.gamma_star < norm <= backoff * optimum.gamma_star


def test_the_lmis_own_observer_measures_what_it_claims():
    optimum = find_optimum(Problem(paper.PLANT, paper.PID, paper.W_D, paper.W_N, (1,)))
    gains = optimum.white.gains(optimum.solution.K, optimum.solution.K_z)
    assert hinf_norm(optimum.problem.error_system(*gains))[0] == pytest.approx(optimum.gamma_star, rel=1e-4)


@pytest.mark.parametrize("seed", a_few(range(3), every=3))
@pytest.mark.parametrize(("p", "m"), [(1, 1), (2, 2), (3, 2)])
def test_with_feedthrough_the_observer_has_no_direct_path_and_lmi_and_riccati_agree(seed, p, m):
    problem = random_problem(seed, p, m, feedthrough=1.0)
    result = synthesize(*problem, delay_samples=1)
    assert not np.any(result.observer.D[:, p:])
    assert np.allclose(result.observer.D[:, :p] @ problem[0].D, 0.0, atol=1e-12)
    assert result.certificate.command_leak < 1e-9
    assert result.certificate.gamma_star_method.startswith("smaller of Riccati")


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_units_scale_the_answer_and_nothing_else(unit):
    """Rates in other units: same level, same margins. Moments in other units: the level scales with them."""
    base = synthesize(paper.PLANT, paper.PID, paper.W_D, paper.W_N).certificate
    rates = synthesize(paper.PLANT * unit, paper.PID * (1 / unit), paper.W_D, paper.W_N * unit).certificate
    moments = synthesize(paper.PLANT * (1 / unit), paper.PID * unit, paper.W_D * unit, paper.W_N).certificate
    assert rates.gamma == pytest.approx(base.gamma, rel=1e-5)
    assert moments.gamma == pytest.approx(unit * base.gamma, rel=1e-5)
    for other in (rates, moments):
        assert other.disk_margin == pytest.approx(base.disk_margin, rel=1e-4)
        assert other.delay_margin_samples == base.delay_margin_samples


def test_channels_whose_units_differ_by_a_million_are_certified():
    plant, controller, W_d, W_n = random_problem(3, 2, 2)
    into, out = np.diag([1e-3, 1e3]), np.diag([1e3, 1e-3])
    result = synthesize(
        static(out) * plant * static(into), controller, static(np.diag([1e3, 1e-3])) * W_d, static(out) * W_n
    )
    assert result.certificate.gamma <= 1.01 * result.certificate.gamma_star
    assert result.certificate.command_leak < 1e-6


def test_a_singular_problem_without_any_noise_is_still_solved():
    """W_n = 0: D21 has no rank at all, which Riccati theory excludes and the LMI does not."""
    proof = synthesize(paper.PLANT, static(0.1), paper.W_D, static(0.0)).certificate
    assert proof.gamma <= 1.01 * proof.gamma_star

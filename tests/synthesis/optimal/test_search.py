"""The best observers for the shipped axes: the programme, the descent, the state space and the weights behind them."""

from dataclasses import replace

import numpy as np
import pytest

from dob_companion.comparison.flight import expect
from dob_companion.comparison.vehicle import close, no_observer
from dob_companion.lti.response import response, spectral_radius
from dob_companion.synthesis import synthesize, zpk
from dob_companion.synthesis.certify.certificate import Claim, certify
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.optimal.descent import descend
from dob_companion.synthesis.optimal.limits import Limit
from dob_companion.synthesis.optimal.poles import free, monic, roots
from dob_companion.synthesis.optimal.problem import Wanted, attenuation
from dob_companion.synthesis.optimal.realization import all_pass, realized, weights
from dob_companion.synthesis.optimal.search import Search, allowed_order, usual_order
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.solve.optimum import find_optimum
from tests.synthesis.optimal.axes import NOISE, axis_of, vehicle_of, weather_of

SHIPPED = {"pitch": (0.400, 3.00e-4), "roll": (0.412, 1.08e-3), "yaw": (0.882, 4.11e-4)}
"""Disk margin and noise in the correction of the tuned specs whose places these observers take."""


def wanted_of(name, gains=(0.7, 1.3)):
    margin, noise = SHIPPED[name]
    return Wanted(disk_margin=margin, noise=noise, noise_rms=NOISE, gains=gains)


def search_of(name, order=6, delay=1):
    return Search(axis_of(name, delay), weather_of(name, delay, seeds=20), order)


def flown(name, observer, gain=1.0, delay=1):
    """RMS attitude error off / on, by the Lyapunov equations of the closed loop."""
    vehicle, rms = vehicle_of(name, delay).with_gain(gain), weather_of(name, delay, seeds=20).rms
    off, on = (expect(close(vehicle, each), rms).attitude for each in (no_observer(vehicle.dt), observer))
    return off / on


@pytest.fixture(scope="module")
def pitch():
    """(search, the best four-pole observer for pitch, plant as modelled)."""
    search = search_of("pitch", 4)
    return search, search.best(wanted_of("pitch", gains=()))


def test_four_poles_on_pitch_reach_what_an_independent_study_found(pitch):
    search, best = pitch
    observer = best.observer(search.axis)
    assert observer.nstates == 4
    assert flown("pitch", observer) > 0.99 * 17.44
    assert flown("pitch", observer) == pytest.approx(1.0 / best.solved.value, rel=1e-3)


def test_every_limit_holds_on_a_fine_grid_from_the_written_matrices(pitch):
    search, best = pitch
    observer, vehicle = best.observer(search.axis), vehicle_of("pitch")
    problem = Problem(vehicle.plant, vehicle.controller, zpk([], [], 1.0, 0.004), zpk([], [], 1.0, 0.004), (1,))
    proof = certify(problem, observer, Claim(1e3, "none", 1e3))
    assert proof.disk_margin > 0.400 * (1.0 - 1e-4)
    assert proof.delay_margin_samples >= 2
    assert proof.slowest_mode_s <= 0.5
    assert proof.command_leak < 1e-9
    heard = expect(close(vehicle, observer), 1.0).noise_in_correction
    assert heard <= 3.00e-4 * 1.001


@pytest.mark.proof
@pytest.mark.parametrize(("name", "nominal"), [("pitch", 17.47), ("roll", 20.26), ("yaw", 33.0)])
def test_six_poles_reach_the_reference_on_every_axis(name, nominal):
    search = search_of(name)
    best = search.best(wanted_of(name, gains=()))
    assert best.order <= 6
    assert flown(name, best.observer(search.axis)) > 0.99 * nominal


@pytest.mark.proof
@pytest.mark.parametrize(
    ("name", "reference"),
    [("pitch", (13.8, 17.1, 18.1)), ("roll", (16.2, 19.7, 20.8)), ("yaw", (30.8, 33.0, 33.9))],
)
def test_with_gain_errors_in_the_objective_all_gains_reach_the_reference(name, reference):
    search = search_of(name)
    observer = search.best(wanted_of(name)).observer(search.axis)
    for gain, least in zip((0.7, 1.0, 1.3), reference, strict=True):
        assert flown(name, observer, gain) > 0.99 * least


def test_a_descent_never_goes_up_and_ends_where_a_step_to_any_side_is_worse():
    search = search_of("roll", 4)
    programme = search.programme(wanted_of("roll"))
    x = free(np.array([0.5, 0.6, 0.7, 0.8], complex), programme.radius)
    end = descend(programme, x)
    assert end.value < programme.solve(x).value
    for i in range(4):
        for side in (-0.05, 0.05):
            assert programme.solve(end.x + side * np.eye(4)[i]).value > end.value * (1.0 - 1e-4)


def test_lines_turned_to_suit_an_observer_lose_nothing_and_the_loop_bears_the_delay():
    """Roll without a link, where upright lines of the delay margin cost most."""
    search = search_of("roll", 5, delay=0)
    programme = search.programme(replace(wanted_of("roll", gains=()), disk_margin=0.4128))
    upright = descend(programme, free(np.array([0.5, 0.6, 0.7, 0.8, 0.3], complex), programme.radius))
    programme.aim(upright.F)
    assert programme.solve(upright.x).value <= upright.value * (1.0 + 1e-6)
    turned = descend(programme, upright.x)
    assert turned.value < 0.97 * upright.value
    observer = realized(search.axis, turned.x, programme.radius, turned.b)
    loops = (close(vehicle_of("roll", 0), observer, attitude=False, unseen=k) for k in (0, 1, 2))
    assert max(spectral_radius(loop.A[:-1, :-1]) for loop in loops) < 1.0


def test_lines_stay_upright_for_values_that_go_around_the_origin():
    angles = np.linspace(0.0, np.pi, 200)
    limit = Limit("any", np.zeros(200, complex), np.ones(200, complex), 0.02, half_plane=True)
    limit.across(np.exp(1j * np.sin(angles)))
    assert np.allclose(limit.slant, np.exp(-1j * np.sin(angles)))
    limit.across(np.exp(2j * angles))
    assert np.all(limit.slant == 1.0)


def test_for_given_poles_no_other_numerator_within_the_limits_is_better(pitch):
    search, best = pitch
    programme, F = search.programme(best.wanted), best.solved.F
    rng = np.random.default_rng(1)
    powers = (
        programme.z[:, None] ** np.arange(4, 1, -1)
        / np.polyval(monic(best.solved.x, best.radius), programme.z)[:, None]
    )
    better = 0
    for _ in range(200):
        other = F + powers @ (rng.standard_normal(3) * 1e-3 * np.abs(best.solved.b))
        on = search.on
        keeps = np.max(np.abs(on.sensitivity(other) - 0.5)) <= 1.0 / 0.4
        noise = np.sqrt(np.sum(np.gradient(on.angles) / np.pi * np.abs(other * on.M) ** 2)) * NOISE <= 3.0e-4
        better += keeps and noise and attenuation(on, search.spectrum, NOISE, other) > 1.001 / best.solved.value
    assert better == 0


@pytest.mark.parametrize("poles", [[0.5, 0.6], [0.9, -0.3, 0.1], [0.5 + 0.4j, 0.5 - 0.4j, 0.7, 0.2]])
def test_poles_as_free_numbers_are_the_same_poles_and_never_leave_the_disk(poles):
    x = free(np.array(poles, complex), 0.99)
    assert np.allclose(np.sort_complex(roots(x, 0.99)), np.sort_complex(np.array(poles, complex)))
    wild = np.random.default_rng(0).standard_normal((50, 5)) * 10.0
    assert all(np.max(np.abs(roots(each, 0.99))) <= 0.99 for each in wild)


def test_an_all_pass_cascade_is_output_normal_however_close_its_poles_lie():
    parts = [np.real(np.poly([p, q])) for p, q in ((0.99, 0.98), (0.985, 0.975), (0.98 + 0.01j, 0.98 - 0.01j))]
    A, C = all_pass(parts)
    assert np.allclose(A.T @ A + C.T @ C, np.eye(6), atol=1e-13)
    assert spectral_radius(A) == pytest.approx(0.99, abs=1e-4)


def test_its_weights_make_it_the_optimal_observer_and_synthesis_finds_it_again(pitch):
    search, best = pitch
    observer, vehicle = best.observer(search.axis), vehicle_of("pitch")
    found = weights(search.axis, observer)
    W_d, W_n = (zpk(form.zeros, form.poles, form.gain, 0.004) for form in (found.disturbance, found.noise))
    problem = Problem(vehicle.plant, vehicle.controller, W_d, W_n, (1,))
    star = find_optimum(problem).gamma_star
    assert star == pytest.approx(1.0, abs=1e-5)
    assert certify(problem, observer, Claim(star, "both", 1.0002)).gamma == pytest.approx(1.0, abs=1e-6)
    again = synthesize(vehicle.plant, vehicle.controller, W_d, W_n, gamma_backoff=1.0003, largest_order=4).observer
    assert np.allclose(response(again, search.on.angles), response(observer, search.on.angles), atol=3e-3)
    assert hinf_norm(again - observer)[0] < 0.01


def test_a_looser_limit_never_gives_less():
    search = search_of("roll", 4)
    asked = wanted_of("roll", gains=())
    rows = [asked, *(replace(asked, disk_margin=m) for m in (0.3, 0.5)), replace(asked, noise=asked.noise / 3.0)]
    found = search.front(search.best(asked), [*rows[1:], replace(asked, disk_margin=0.5, noise=asked.noise / 3.0)])
    here, loose, tight, quiet, both = (1.0 / each.solved.value for each in found)
    assert loose >= here >= tight >= both
    assert here >= quiet >= both


def test_a_plant_of_four_states_may_have_eight():
    """Six leave the numerator three numbers, with which ArduCopter's roll attenuates half as much."""
    two = axis_of("pitch")
    four = replace(two, m=np.convolve(two.m, [1.0, -0.5, 0.1]))
    assert [usual_order(axis) for axis in (two, four)] == [6, 8]
    assert [allowed_order(four, stated) for stated in (None, 5, 8, 12)] == [8, 5, 8, 8]

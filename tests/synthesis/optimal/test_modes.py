"""Plants of many sharp modes: weights whose optimum rounding would spoil, coordinates, T_f drawn around the origin."""

import control as ct
import numpy as np
import pytest

from dob_companion.comparison.vehicle import Vehicle
from dob_companion.lti.response import response
from dob_companion.synthesis import parse_spec, zpk
from dob_companion.synthesis.optimal.exact import exact_optimum
from dob_companion.synthesis.optimal.problem import Axis, Spectrum, Wanted
from dob_companion.synthesis.optimal.realization import left_zeros, realized, weights
from dob_companion.synthesis.optimal.search import Search
from dob_companion.synthesis.plant.estimation import estimation_problem
from dob_companion.synthesis.plant.models import discretize, polynomial, to_state_space
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.solve.rest import resting
from dob_companion.synthesis.solve.scaling import rough_scaling
from dob_companion.synthesis.spec.spectrum import LowPass
from dob_companion.synthesis.tune import best as best_module
from dob_companion.synthesis.tune.tuning import Task, designed_and_tuned
from tests.synthesis.optimal.axes import axis_of, vehicle_of
from tests.synthesis.optimal.test_any_limits import kept

DT = 0.004
MODES = ((60.0, 75.0), (110.0, 130.0), (190.0, 210.0))
"""Anti-resonance and resonance of each, rad/s."""


def flexible(count, gain=300.0, damping=0.02, modes=MODES):
    """num and den in s: 1 / (s (0.05 s + 1)), and so many modes."""
    num, den = np.array([gain]), np.array([0.05, 1.0, 0.0])
    for zero, pole in modes[:count]:
        num = np.polymul(num, [1.0 / zero**2, 2.0 * damping / zero, 1.0])
        den = np.polymul(den, [1.0 / pole**2, 2.0 * damping / pole, 1.0])
    return num, den


def spec_of(num, den, delay=1, controller=(0.05, 0.05), **asked):
    auto = {
        "disturbance_corner_hz": 1.0,
        "disturbance_rms": 0.05,
        "noise_rms": 1e-3,
        "least_disk_margin": 0.35,
        "largest_noise_in_correction": 1e-2,
    } | asked
    lines = [f"[design]\nrate_hz = 250.0\ndelay_samples = {delay}\n[auto]", *(f"{k} = {v}" for k, v in auto.items())]
    lines += ['[[block]]\nname = "any"\naxes = ["roll"]']
    lines += [f'[block.plant]\ndomain = "s"\nnum = {num.tolist()}\nden = {den.tolist()}']
    lines += [f'[block.controller]\ndomain = "s"\nmethod = "tustin"\nnum = {list(controller)}\nden = [1.0, 0.0]']
    return parse_spec("\n".join(lines))


def vehicle_in(spec):
    (block,) = spec.blocks
    return Vehicle(
        *(to_state_space(model, DT, (1, 1)) for model in (block.plant, block.controller)),
        block.delay_samples,
        block.auto.attitude_gain,
    )


def test_the_optimum_of_weights_in_closed_form_is_found_from_one_near_it_to_the_last_digits():
    axis, vehicle = axis_of("pitch"), vehicle_of("pitch")
    programme = Search(axis, Spectrum(LowPass(1.0)), 4).programme(
        Wanted(disk_margin=0.4, noise=3e-4, noise_rms=4e-4, gains=())
    )
    best = programme.solve(np.array([-0.95, 0.79, -1.94, 1.05]))
    observer, near = (realized(axis, best.x, programme.radius, share * best.b) for share in (1.0, 1.02))
    found = weights(axis, observer)
    W_d, W_n = (zpk(form.zeros, form.poles, form.gain, DT) for form in (found.disturbance, found.noise))
    exact = exact_optimum(Problem(vehicle.plant, vehicle.controller, W_d, W_n, (1,)), near, 1.0)
    angles = np.geomspace(1e-3, np.pi, 300)
    true, apart = (response(each, angles) for each in (observer, near))
    assert exact.nstates == 4
    assert np.max(np.abs(response(exact, angles) - true)) < 1e-7 * np.max(np.abs(true))
    assert np.max(np.abs(apart - true)) > 1e-2 * np.max(np.abs(true))


def test_weights_of_another_form_have_no_optimum_in_closed_form():
    vehicle, near = vehicle_of("pitch"), realized(axis_of("pitch"), np.zeros(4), 0.99, np.ones(3))
    lag = zpk([], [0.9], 0.1, DT)
    assert exact_optimum(Problem(vehicle.plant, vehicle.controller, lag, lag, (1,)), near, 1.0) is None


def test_a_polynomial_of_three_modes_becomes_a_system_whose_states_are_of_one_size():
    num, den = flexible(3)
    found = discretize(polynomial(num, den, 0.0), DT, "zoh")
    assert np.max(np.abs(found.A)) < 1e3
    parts = ct.c2d(ct.ss(ct.tf(num, den)), DT)
    angles = np.linspace(0.05, 3.0, 100)
    assert np.allclose(response(found, angles), response(parts, angles), rtol=1e-6)


def test_sharp_modes_of_plant_and_weight_are_not_taken_for_modes_at_rest():
    """By the first samples alone the states had sizes 1e8 apart, and all but three modes counted as unmoved."""
    plant = discretize(polynomial(*flexible(3), 0.0), DT, "zoh")
    sharp = [r * np.exp(1j * t) for r, t in ((0.989, 0.0130), (0.995, 0.166), (0.991, 0.266))]
    blunt = [r * np.exp(1j * t) for r, t in ((0.970, 0.0634), (0.994, 0.161), (0.992, 0.2687))]
    W_d = zpk([*blunt, *np.conj(blunt)], [*sharp, *np.conj(sharp)], 0.95, DT)
    posed = estimation_problem(plant, W_d, zpk([], [], 0.05, DT), (1,))
    assert np.max(np.abs(posed.transformed(*rough_scaling(posed)).A)) < 10.0
    assert resting(posed, W_d) is None


def test_an_observer_whose_T_f_goes_around_the_origin_is_led_to_one_that_has_weights():
    """Its zeros lie outside the unit circle, so that no stable W_d has them as poles."""
    plant = discretize(polynomial(*flexible(1, modes=((75.0, 60.0),), damping=0.01), 0.0), DT, "zoh")
    axis = Axis.of(plant, ct.ss(ct.c2d(ct.tf([0.05, 0.05], [1.0, 0.0]), DT, "tustin")), 2, 2.0)
    search = Search(axis, Spectrum(LowPass(1.0)), 6)
    begun = search.quick(Wanted(disk_margin=0.3, noise=0.1, noise_rms=1e-3, delay_margin=0, gains=()))
    assert np.max(np.abs(left_zeros(begun.observer(axis), 2))) > 1.01
    assert weights(axis, begun.observer(axis)) is None
    led = search.weighable(begun)
    assert np.max(np.abs(left_zeros(led.observer(axis), 2))) < 1.0
    assert weights(axis, led.observer(axis)) is not None
    assert led.solved.value < 0.05
    assert search.weighable(led) is led


@pytest.fixture
def alone(monkeypatch):
    """No trade-off around what is asked."""
    monkeypatch.setattr(best_module._Choice, "others", lambda _: [])
    monkeypatch.setattr(best_module._Choice, "quieter", lambda *_: [])


@pytest.mark.proof
@pytest.mark.parametrize("count", [2, 3])
def test_a_plant_of_two_or_three_modes_gets_a_design_of_as_many_states_as_its_optimum(count, alone):
    spec = spec_of(*flexible(count))
    block, _ = designed_and_tuned(Task(spec.blocks[0], spec.dt, spec.blocks[0].auto))
    kept(block, vehicle_in(spec), spec.blocks[0].auto)
    assert block.observer.order == 2 * count + 6  # four more than the plant has
    assert block.certificate.gamma <= 1.0003 * block.certificate.gamma_star
    assert 1.0 < block.certificate.extra["attenuation"] < block.certificate.extra["attenuation_limit"]


LOADED = (
    ([40.0, 68.0], [54.0, 63.0], 0.33, 3, 3e-3, 2),
    ([62.0, 105.0], [70.0, 108.0], 0.55, 1, 9e-4, 0),
)
"""Anti-resonances, resonances, disk margin, delay margin, noise, link delay."""


@pytest.mark.proof
@pytest.mark.parametrize(("zeros", "poles", "margin", "late", "noise", "delay"), LOADED)
def test_a_plant_of_sharp_modes_is_designed_within_tight_limits(zeros, poles, margin, late, noise, delay, alone):
    asked = {"least_disk_margin": margin, "least_delay_margin_samples": late, "largest_noise_in_correction": noise}
    num, den = flexible(2, gain=60.0, damping=0.012, modes=tuple(zip(zeros, poles, strict=True)))
    spec = spec_of(num, den, delay, (0.1, 0.1), attitude_gain=1.5, **asked)
    block, _ = designed_and_tuned(Task(spec.blocks[0], spec.dt, spec.blocks[0].auto))
    kept(block, vehicle_in(spec), spec.blocks[0].auto)

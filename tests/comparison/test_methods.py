"""Each method against what its source promises, computed by another route."""

import control as ct
import numpy as np
import pytest
from scipy import signal

from dob_companion.comparison.augmented import augment
from dob_companion.comparison.conventional import approximate_inverse, conventional
from dob_companion.comparison.eso import extended_state_observer, integrator_chain, integrator_chain_observer
from dob_companion.comparison.flight import NOISE_SIGMA, disturbance_pole
from dob_companion.comparison.indi import actuator_model, indi
from dob_companion.comparison.kalman import kalman, steady_gain
from dob_companion.comparison.open_loop import open_loop_hinf, optimal_all_pass, polynomials
from dob_companion.comparison.rational import NotApplicableError, low_passed, observer_from, roots_of
from dob_companion.lti.response import response
from dob_companion.synthesis import synthesize, zpk
from tests.synthesis.paper import DT, PID, PLANT, W_D

ANGLES = np.linspace(1e-3, np.pi, 400)
SIGMA = 0.05
PLANTS = {
    "paper": PLANT,
    "minimum phase": zpk([-0.9], [1.0, 0.9447], 0.2, DT),
    "slow zero outside": zpk([1.2, 0.5], [0.97, 0.9, 0.8], -0.2, DT),
    "complex zeros outside": zpk([1.1 + 0.4j, 1.1 - 0.4j], [0.99, 0.9, 0.8], 0.1, DT),
}
METHODS = {
    "ZPETC": lambda plant: conventional(plant, "ZPETC", 2, 10.0),
    "ZMETC": lambda plant: conventional(plant, "ZMETC", 3, 10.0),
    "open-loop": lambda plant: open_loop_hinf(plant, 1, polynomials(W_D)),
    "kalman": lambda plant: kalman(plant, 1, 1.0, SIGMA, NOISE_SIGMA),
    "eso": lambda plant: extended_state_observer(plant, 1, 10.0),
    "eso, integrators": lambda plant: integrator_chain_observer(plant, 1, 10.0),
    "indi": lambda plant: indi(plant, 10.0),
}


def scalar(system):
    return response(system, ANGLES)[:, 0, 0]


def inverse_response(plant, method):
    above, below = approximate_inverse(plant, method)
    z = np.exp(1j * ANGLES)
    return np.polyval(above, z) / np.polyval(below, z)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
def test_zpetc_leaves_no_phase_at_any_frequency(plant):
    left = scalar(plant) * inverse_response(plant, "ZPETC")
    assert np.max(np.abs(left.imag)) < 1e-9 * np.max(np.abs(left))
    assert np.min(left.real) > 0.0
    assert left[0].real == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
def test_zmetc_leaves_the_magnitude_at_every_frequency(plant):
    assert np.abs(scalar(plant) * inverse_response(plant, "ZMETC")) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
@pytest.mark.parametrize("build", METHODS.values(), ids=METHODS.keys())
def test_every_observer_is_stable_and_answers_u_e_a_sample_later(build, plant):
    D = build(plant)
    assert D.D.shape == (1, 2)
    assert D.D[0, 1] == 0.0
    assert np.max(np.abs(np.linalg.eigvals(D.A))) < 1.0
    assert D.dt == DT


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
@pytest.mark.parametrize("name", ["open-loop", "kalman", "eso"])
def test_observers_that_hold_the_whole_model_are_deaf_to_commands(name, plant):
    D = response(METHODS[name](plant), ANGLES)[:, 0, :]
    leak = D[:, 0] * scalar(plant) + D[:, 1]
    assert np.max(np.abs(leak)) < 1e-8 * np.max(np.abs(D[:, 1]))


@pytest.mark.parametrize("build", METHODS.values(), ids=METHODS.keys())
def test_no_observer_carries_a_state_that_does_nothing(build):
    D = build(PLANT)
    grams = [ct.dlyap(D.A, D.B @ D.B.T), ct.dlyap(D.A.T, D.C.T @ D.C)]
    hankel = np.sqrt(np.abs(np.linalg.eigvals(grams[0] @ grams[1])))
    assert np.min(hankel) > 1e-10 * np.max(hankel)


@pytest.mark.parametrize("name", ["ZPETC", "ZMETC", "eso"])
def test_a_constant_disturbance_is_found_exactly(name):
    D = response(METHODS[name](PLANT), np.array([1e-6]))[0, 0]
    G = response(PLANT, np.array([1e-6]))[0, 0, 0]
    assert D[0] * G == pytest.approx(1.0, abs=1e-4)


def test_the_conventional_q_is_the_butterworth_filter_delayed_until_causal():
    D = response(conventional(PLANT, "ZPETC", 3, 12.0), ANGLES)[:, 0, :]
    _, Q = signal.freqz(*signal.butter(3, 12.0, fs=1.0 / DT), worN=ANGLES)
    assert -D[:, 1] == pytest.approx(Q * np.exp(-2j * ANGLES), abs=1e-10)
    assert D[:, 0] == pytest.approx(Q * np.exp(-2j * ANGLES) * inverse_response(PLANT, "ZPETC"), abs=1e-9)


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("hertz", [0.1, 5.0, 90.0])
def test_the_low_pass_in_sections_is_scipys(order, hertz):
    straight = ct.ss([], [], [], [[1.0, 2.0]], DT)
    filtered = low_passed(straight, order, hertz)
    _, H = signal.sosfreqz(signal.butter(order, hertz, fs=1.0 / DT, output="sos"), worN=ANGLES)
    assert filtered.nstates == order
    assert response(filtered, ANGLES)[:, 0, 1] == pytest.approx(2.0 * H, abs=1e-9)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
@pytest.mark.parametrize("hertz", [2.0, 29.0])
def test_all_poles_of_the_extended_state_observer_lie_where_they_were_asked(plant, hertz):
    D = extended_state_observer(plant, 1, hertz)
    wanted = np.poly(np.full(plant.nstates + 1, np.exp(-2.0 * np.pi * hertz * DT)))
    assert np.poly(D.A) == pytest.approx(wanted, rel=1e-6, abs=1e-8)


def test_the_chain_of_integrators_is_the_plant_where_its_poles_are_slow():
    """b_0 = 1735 rad/s² per unit times the lag's 14.2 1/s, to the accuracy of reading them in z."""
    chain = integrator_chain(PLANT)
    assert (chain.C @ chain.A @ chain.B - chain.C @ chain.B)[0, 0] / DT**2 == pytest.approx(1735.0 * 14.2, rel=0.05)
    at = np.array([1.0])
    assert response(chain, at)[0, 0, 0] == pytest.approx(response(PLANT, at)[0, 0, 0], rel=0.15)
    with pytest.raises(NotApplicableError, match="slow poles"):
        integrator_chain(zpk([], [1.0, 0.5], 0.1, DT))


@pytest.mark.parametrize("noise", [NOISE_SIGMA, 30.0 * NOISE_SIGMA])
def test_the_kalman_gain_is_where_a_long_riccati_recursion_ends(noise):
    model = augment(PLANT, disturbance_pole(DT))
    W = np.diag([0.0, 0.0, SIGMA**2 * (1.0 - model.a**2)])
    P = np.eye(3)
    for _ in range(20000):
        M = P @ model.C.T / (model.C @ P @ model.C.T + noise**2)
        P = model.A @ (P - M @ model.C @ P) @ model.A.T + W
    assert steady_gain(model, SIGMA, noise) == pytest.approx(M, rel=1e-7)


def test_no_neighbouring_gain_estimates_the_disturbance_better_than_kalmans():
    model = augment(PLANT, disturbance_pole(DT))
    M = steady_gain(model, SIGMA, NOISE_SIGMA)

    def error(gain):
        kept = np.eye(3) - gain @ model.C
        into = np.hstack([np.eye(3)[:, 2:] * SIGMA * np.sqrt(1.0 - model.a**2), -model.A @ gain * NOISE_SIGMA])
        P = ct.dlyap(model.A @ kept, into @ into.T)
        late = kept @ P @ kept.T + gain @ gain.T * NOISE_SIGMA**2
        return late[2, 2]

    for i in range(3):
        for factor in (0.95, 1.05):
            other = M.copy()
            other[i] *= factor
            assert error(other) > error(M)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_open_loop_optimum_is_the_lmis_as_its_noise_vanishes(delay):
    gamma, _ = optimal_all_pass(roots_of(PLANT), delay, polynomials(W_D))
    silent = ct.ss([], [], [], [[1e-6]], DT)
    found = synthesize(PLANT, PID, W_D, silent, delay_samples=delay).certificate
    assert abs(gamma) == pytest.approx(found.gamma_star, rel=1e-5)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
def test_the_open_loop_error_is_all_pass_at_its_optimum(plant):
    gamma, _ = optimal_all_pass(roots_of(plant), 1, polynomials(W_D))
    D = response(open_loop_hinf(plant, 1, polynomials(W_D)), ANGLES)[:, 0, :]
    left = 1.0 - np.exp(-1j * ANGLES) * D[:, 0] * scalar(plant)
    assert np.abs(scalar(W_D) * left) == pytest.approx(abs(gamma), rel=1e-6)


@pytest.mark.parametrize("weight", [zpk([], [0.99], 0.05, DT), zpk([0.3, -0.2], [0.99, 0.8], 2.0, DT)])
def test_the_open_loop_design_takes_any_stable_weight_of_one_input(weight):
    gamma, _ = optimal_all_pass(roots_of(PLANT), 1, polynomials(weight))
    D = response(open_loop_hinf(PLANT, 1, polynomials(weight)), ANGLES)[:, 0, :]
    left = 1.0 - np.exp(-1j * ANGLES) * D[:, 0] * scalar(PLANT)
    assert np.abs(scalar(weight) * left) == pytest.approx(abs(gamma), rel=1e-6)


def test_a_weight_that_the_open_loop_design_cannot_use_is_named():
    with pytest.raises(NotApplicableError, match="inside the unit circle"):
        polynomials(zpk([1.2], [0.9], 1.0, DT))
    with pytest.raises(NotApplicableError, match="one input"):
        polynomials(ct.ss([], [], [], [[1.0, 1.0]], DT))


def test_indi_reads_effectiveness_lag_and_delay_off_the_plant():
    model = actuator_model(PLANT)
    assert model.effectiveness == pytest.approx(1735.0, abs=0.5)
    assert (model.pole, model.delay) == (pytest.approx(0.9447), 1)
    ideal = actuator_model(zpk([], [1.0], 0.4, DT))
    assert (ideal.effectiveness, ideal.pole, ideal.delay) == (pytest.approx(100.0), 0.0, 0)


def test_indi_is_the_incremental_law_of_its_source_step_by_step():
    """u_c = u_f + (nu - omega_dot_f) / g, written as a loop over samples; d_hat is what it adds to u = nu / g."""
    rng = np.random.default_rng(1)
    y, u_e = rng.standard_normal((2, 400))
    model = actuator_model(PLANT)
    b, a = signal.butter(2, 20.0, fs=1.0 / DT)
    acceleration = np.diff(y, prepend=0.0) / DT
    actuator = np.zeros(400)
    for k in range(1, 400):
        actuator[k] = model.pole * actuator[k - 1] + (1.0 - model.pole) * u_e[k - 1]
    late = np.concatenate([np.zeros(model.delay), actuator])[:400]
    u_f, omega_dot_f = signal.lfilter(b, a, late), signal.lfilter(b, a, acceleration)
    nu = rng.standard_normal(400)
    u_c = u_f + (nu - omega_dot_f) / model.effectiveness
    d_hat = np.ravel(ct.forced_response(indi(PLANT, 20.0), U=np.vstack([y, u_e])).outputs)
    assert nu / model.effectiveness - d_hat == pytest.approx(u_c, abs=1e-9)


def test_a_method_without_a_form_for_the_plant_says_what_it_lacks():
    on_circle = zpk([-1.0], [1.0, 0.9], 0.1, DT)
    with pytest.raises(NotApplicableError, match="unit circle"):
        conventional(on_circle, "ZMETC", 2, 10.0)
    with pytest.raises(NotApplicableError, match="unit circle"):
        open_loop_hinf(on_circle, 1, polynomials(W_D))
    with pytest.raises(NotApplicableError, match="zero at z = 1"):
        conventional(zpk([1.0], [0.9, 0.8], 0.1, DT), "ZPETC", 2, 10.0)
    with pytest.raises(NotApplicableError, match="z = 0"):
        extended_state_observer(zpk([], [1.0, 0.0], 0.1, DT), 1, 10.0)
    with pytest.raises(NotApplicableError, match="integrates"):
        indi(zpk([], [0.5], 0.1, DT), 10.0)


def test_an_observer_that_is_not_causal_or_answers_u_e_at_once_is_not_built():
    with pytest.raises(ValueError, match="causal"):
        observer_from(np.array([1.0, 0.0, 0.0]), np.array([1.0]), np.array([1.0, 0.5]), DT)
    with pytest.raises(ValueError, match="direct path"):
        observer_from(np.array([1.0]), np.array([1.0, 0.0]), np.array([1.0, 0.5]), DT)

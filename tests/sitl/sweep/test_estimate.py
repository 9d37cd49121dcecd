"""The estimator against a closed loop whose plant is known exactly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.airframe.linear import PITCH, RateAxis
from sitl.sweep.estimate import frequency_response
from sitl.sweep.fit import fit_rate_axis, response_of
from sitl.sweep.identify import identify
from sitl.sweep.multisine import Plan, measured
from tests.effort import examples
from tests.sitl.sweep.loop import closed_loop

PLAN = Plan(realizations=8)
NOISE = 10.0 ** (-68.0 / 20.0)


def estimate(noise, seed=1, model=PITCH, plan=PLAN):
    u, y, r = (measured(plan, signal) for signal in closed_loop(model, plan, seed, noise))
    return u, y, frequency_response(r, u, y, plan.lines)


def test_without_noise_the_response_is_the_plant():
    _, _, found = estimate(0.0)
    true = response_of(PITCH, found.frequency)
    above = (found.frequency > 4.0) & (found.frequency < 400.0)
    np.testing.assert_allclose(found.value[above], true[above], rtol=5e-3)
    assert found.coherence_u[above].min() > 0.9999
    assert found.coherence_y[above].min() > 0.9999


def test_the_stated_deviation_is_the_error():
    errors = []
    for seed in range(6):
        _, _, found = estimate(10.0 * NOISE, seed)
        errors.append(np.abs(found.value - response_of(PITCH, found.frequency)) / found.deviation)
    assert np.mean(np.square(errors)) == pytest.approx(1.0, abs=0.15)


def test_noise_that_runs_round_the_loop_biases_the_usual_estimate_and_not_this_one():
    plan = Plan(realizations=60)
    u, y, found = estimate(30.0 * NOISE, plan=plan)
    U, Y = (np.fft.rfft(signal, axis=1)[:, plan.lines] for signal in (u, y))
    usual = np.mean(Y * U.conj(), axis=0) / np.mean(np.abs(U) ** 2, axis=0)
    true = response_of(PITCH, found.frequency)
    high = found.frequency > 250.0
    bias = [np.abs(np.mean((value / true - 1.0)[high])) for value in (found.value, usual)]
    spread = np.sqrt(np.mean((found.deviation / np.abs(true))[high] ** 2) / np.count_nonzero(high))
    assert bias[0] < 3.0 * spread
    assert bias[1] > 5.0 * spread
    assert found.coherence_y[high].min() < 0.9


def test_one_realization_has_no_variance():
    one = np.ones((1, 100))
    with pytest.raises(ValueError, match="at least 2"):
        frequency_response(one, one, one, np.array([1, 2]))


@given(gain=st.floats(0.02, 0.3), zero=st.floats(-3.0, -0.3), pole=st.floats(0.85, 0.98))
@settings(max_examples=examples(50), deadline=None)
def test_the_fit_returns_any_model_of_its_form(gain, zero, pole):
    model = RateAxis(gain, zero, pole)
    _, _, found = estimate(0.0)
    exact = type(found)(found.frequency, response_of(model, found.frequency), *[np.ones_like(found.frequency)] * 3)
    fit = fit_rate_axis(exact)
    np.testing.assert_allclose([fit.model.gain, fit.model.zero, fit.model.pole], [gain, zero, pole], rtol=1e-6)
    assert fit.worst < 1e-7


@pytest.mark.parametrize("model", [PITCH, RateAxis(0.05, -1.2, 0.93), RateAxis(0.2, -2.4, 0.96)])
def test_the_model_comes_back_within_its_stated_uncertainty(model):
    misses = []
    for seed in range(8):
        fit = identify("pitch", PLAN, closed_loop(model, PLAN, seed, 3.0 * NOISE)).fit
        for name in ("gain", "zero", "pole"):
            misses.append((getattr(fit.model, name) - getattr(model, name)) / getattr(fit.deviation, name))
    assert np.abs(misses).max() < 4.5
    assert 0.5 < np.sqrt(np.mean(np.square(misses))) < 1.6


def test_a_band_with_too_few_lines_is_refused():
    _, _, found = estimate(0.0)
    with pytest.raises(ValueError, match="0 lines from 1e-05 to"):
        fit_rate_axis(found, (1e-5, 0.1))

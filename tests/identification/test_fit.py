"""What a fit makes of a response that is known badly: neither its gain nor what it states of it is off."""

from dataclasses import fields

import numpy as np
import pytest

from dob_companion.autopilots.transfer import NOTHING
from dob_companion.identification.fit import DELAY, LAG, POLE, Data, Fit, fit, spread
from dob_companion.identification.spectra import LEFT, Estimate

BANDS, AVERAGES, RUNS = 12, 9, 300
P = np.array([1.0, 0.05, 0.01, 0.0])
FREQUENCY = np.geomspace(3.0, 60.0, BANDS)


def noise(rng, *shape):
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)


def seen(rng, strength):
    """A true response of gain 1, by an instrument r of so much more power in the input v than wind, which the
    controller lets act on input and output alike; sums over AVERAGES windows in each band."""
    bare = Data(FREQUENCY, np.ones(BANDS, complex), np.ones(BANDS), NOTHING, 0.004).model(P)
    r, wind = noise(rng, BANDS, AVERAGES), noise(rng, BANDS, AVERAGES) / np.sqrt(strength)
    v = r + wind
    y = v - 0.8 * wind + 0.3 * noise(rng, BANDS, AVERAGES) / np.sqrt(strength)

    def sums(a, b):
        return np.sum(a * b.conj(), axis=1)

    S_vr, R = sums(v, r), sums(r, r).real
    H = sums(y, r) / S_vr
    error, own = y - H[:, None] * v, v - (S_vr / R)[:, None] * r
    share = R / np.abs(S_vr) ** 2 / (AVERAGES - 1)
    rest, weak = H + sums(error, own) / sums(own, own), sums(own, own).real * share
    deviation = np.sqrt(sums(error, error).real * share)
    return Data(FREQUENCY, H * bare, deviation * np.abs(bare), NOTHING, 0.004, rest * bare, weak)


def test_a_weak_instrument_does_not_draw_the_gain_to_the_controller():
    rng = np.random.default_rng(1)
    found = [seen(rng, strength=3.0) for _ in range(RUNS)]
    gains = [data.gain(P) for data in found]
    assert np.mean(gains) == pytest.approx(1.0, abs=4.0 * np.std(gains) / np.sqrt(RUNS))
    fixed = [Data(d.frequency, d.value, d.deviation, NOTHING, d.dt).gain(P) for d in found]
    assert np.mean(fixed) < 0.97  # by deviations that are small where chance draws to it


def test_the_best_gain_leaves_the_least_squares():
    data = seen(np.random.default_rng(2), strength=2.0)
    gain = data.gain(P)
    squares = [np.sum(data.residual(gain * times, P) ** 2) for times in (0.98, 1.0, 1.02)]
    assert squares[1] < min(squares[0], squares[2])


def test_a_lag_as_good_as_none_is_none():
    data = Data(FREQUENCY, np.ones(BANDS, complex), np.ones(BANDS), NOTHING, 0.004)
    with np.errstate(all="raise"):
        responses = [data.model(np.array([2.0, lag, 0.01, 0.0])) for lag in (0.0, 1e-105, 1e-8)]
    for each in responses[1:]:
        np.testing.assert_allclose(each, responses[0], rtol=1e-5)


@pytest.mark.parametrize("lag", [0.0, 2e-7])
def test_the_interval_of_a_lag_that_is_hardly_there_ends_where_the_data_end_it(lag):
    rng, true = np.random.default_rng(4), np.array([2.0, 0.0, 0.004, 0.0])
    frequency = np.geomspace(4.0, 200.0, 30)
    bare = Data(frequency, np.ones(30, complex), np.ones(30), NOTHING, 0.004).model(true)
    data = Data(frequency, bare * (1.0 + 0.01 * noise(rng, 30)), 0.01 * np.abs(bare), NOTHING, 0.004)
    best = fit(data, (POLE, LAG, DELAY), true)
    near = np.where(np.arange(4) == LAG, lag, best.parameters)
    width = spread(Fit(best.gain, near, best.free, float(np.sum(data.left(near) ** 2)), data))
    assert best.parameters[LAG] < 1e-3
    assert 1e-4 < width.parameters[LAG][1] < 3e-3


def test_weights_that_are_estimated_are_believed_as_far_as_a_mean_of_them_scatters():
    rng, averages = np.random.default_rng(3), 7.0
    freedom = 2.0 * (averages - LEFT)
    estimate = Estimate(*(np.full(1, averages) for _ in fields(Estimate)))
    believed = rng.chisquare(freedom, (4000, 40)) / freedom * estimate.wider
    weights = 1.0 / believed
    means = np.sum(weights * rng.standard_normal(weights.shape), axis=1) / np.sum(weights, axis=1)
    assert np.var(means) == pytest.approx(np.mean(1.0 / np.sum(weights, axis=1)), rel=0.1)

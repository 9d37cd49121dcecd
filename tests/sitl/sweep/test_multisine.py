"""The excitation is what it says."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sitl.sweep.multisine import Plan, excitation, measured

SMALL = Plan(realizations=3, period=625, lead=700, highest=300.0)


def test_the_default_plan_excites_from_half_a_radian_to_beyond_600():
    plan = Plan()
    assert 0.5 < plan.frequencies[0] < 0.51
    assert plan.frequencies[-1] > 600.0
    assert np.diff(plan.lines).min() == 1
    assert np.diff(np.log(plan.frequencies[plan.frequencies > 100.0])).max() < 0.025


@given(st.integers(0, 2**32 - 1))
def test_what_is_measured_is_one_whole_period_of_steady_state(seed):
    signal = excitation(SMALL, seed)
    assert signal.shape == (SMALL.samples,)
    periods = measured(SMALL, signal)
    assert periods.shape == (3, 625)
    np.testing.assert_allclose(np.sqrt(np.mean(periods**2, axis=1)), SMALL.rms)
    for i, period in enumerate(periods):
        before = signal[i * 1325 : i * 1325 + 700]
        np.testing.assert_array_equal(before, np.concatenate([period[-75:], period]))


def test_power_is_in_the_lines_and_nowhere_else():
    spectrum = np.abs(np.fft.rfft(measured(SMALL, excitation(SMALL, 1)), axis=1))
    outside = np.ones(spectrum.shape[1], bool)
    outside[SMALL.lines] = False
    assert spectrum[:, outside].max() < 1e-12 * spectrum.max()
    assert (np.diff(spectrum[:, SMALL.lines], axis=1) < 1e-12 * spectrum.max()).all()


def test_realizations_differ_and_a_seed_repeats_them():
    first, second, _ = measured(SMALL, excitation(SMALL, 1))
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.5
    np.testing.assert_array_equal(excitation(SMALL, 1), excitation(SMALL, 1))
    assert not np.array_equal(excitation(SMALL, 1), excitation(SMALL, 2))

"""The exact sampled model, against scipy and against the closed form of a double integrator."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, dlsim, lfilter

from sitl.airframe.linear import PITCH
from sitl.constants import DT
from sitl.sweep.sampling_zero import as_paper_fits, behind, delay_of_zero, main, sampled
from tests.pages import table


@pytest.mark.parametrize("delay", [0.0, 3 / 16 * DT, 11 / 16 * DT])
def test_the_exact_model_is_the_fine_simulation_seen_every_sample(delay):
    slope, lag, fine = 1735.0, 0.07, 16
    u = np.random.default_rng(1).standard_normal(60)
    shifted = np.concatenate([np.zeros(round(delay / DT * fine)), np.repeat(u, fine)])[: 60 * fine]
    states = [[0.0, slope], [0.0, -1.0 / lag]], [[0.0], [1.0 / lag]], [[1.0, 0.0]], [[0.0]]
    expected = dlsim(cont2discrete([np.array(part) for part in states], DT / fine), shifted)[1][::fine, 0]
    num, den = sampled(slope, lag, delay)
    np.testing.assert_allclose(lfilter([0.0, *num], den, u), expected, atol=1e-9 * np.abs(expected).max())


@given(st.floats(0.0, 0.95))
def test_with_a_slow_rotor_the_zeros_are_those_of_a_delayed_double_integrator(share):
    num, _ = sampled(1.0, 1e4, share * DT)
    closed = np.array([(1.0 - share) ** 2, 1.0 + 2.0 * share - 2.0 * share**2, share**2])
    np.testing.assert_allclose(num / num.sum(), closed / closed.sum(), atol=1e-5)


def test_half_a_millisecond_of_delay_behind_70_ms_of_lag_is_the_papers_plant():
    slope, lag, delay = behind(PITCH)
    assert slope == pytest.approx(1735.0, abs=1.0)
    assert lag == pytest.approx(0.0703, abs=1e-4)
    assert delay == pytest.approx(0.549e-3, abs=2e-6)
    fit = as_paper_fits(slope, lag, delay)
    assert (fit.model.gain, fit.model.zero, fit.model.pole) == pytest.approx((0.14131, -1.716, 0.9447), rel=1e-6)
    assert fit.worst < 3e-4
    assert delay_of_zero(PITCH.zero, lag) == pytest.approx(0.62e-3, abs=2e-6)


def test_without_delay_the_zero_is_inside_the_unit_circle():
    num, _ = sampled(1735.0, 0.0703, 0.0)
    np.testing.assert_allclose(np.roots(np.trim_zeros(num, "b")), [-0.981], atol=1e-3)


def test_a_delay_of_a_whole_sample_is_refused():
    with pytest.raises(ValueError, match="less than a sample"):
        sampled(1.0, 0.07, DT)


def test_the_documented_table_is_what_the_command_prints(capsys):
    main()
    printed = [line.split("|")[:-2] for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    shown = [line.split("|")[:-2] for line in table("identification.md", "python -m sitl.sweep.sampling_zero")]
    assert shown == printed  # but for the misfit, whose first row is rounding

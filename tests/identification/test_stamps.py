"""Stamps that cannot be right: a gyro that answers before its moment, a clock that runs fast or slow."""

from dataclasses import replace

import numpy as np
import pytest

from dob_companion.identification.identify import identify
from dob_companion.identification.record import Signal
from tests.identification.hovering import Axis, fly, record

FLOWN = fly([Axis(wind=1.0)] * 3, 30, 11)
LEADING = Axis(gain=198.0, pole=0.4, lag=0.0665, delay=0.001, p=0.05, i=0.03, wind=1.0, shape=lambda s: 1.0 + 0.035 * s)
"""Rotors that answer by their inertia before they do by their thrust: as early as an aircraft gets."""


def angles_of(flight):
    """Roll, pitch and yaw that these body rates turn to, by small steps of a rotation matrix."""
    turned, found = np.eye(3), []
    for p, q, r in flight.y * flight.dt:
        found.append((np.arctan2(turned[2, 1], turned[2, 2]), -np.arcsin(turned[2, 0]),
                      np.arctan2(turned[1, 0], turned[0, 0])))  # fmt: skip
        turned = turned @ (np.eye(3) + np.array([[0.0, -r, q], [r, 0.0, -p], [-q, p, 0.0]]))
        turned = turned @ (1.5 * np.eye(3) - 0.5 * turned.T @ turned)
    return np.array(found)


def moved(signal, *, by=0.0, times=1.0):
    return None if signal is None else Signal(by + times * signal.time, signal.values)


@pytest.fixture(scope="module")
def whole():
    flown = record(FLOWN, rate_setpoint=None)
    return replace(flown, attitude=Signal(flown.rates.time[::5], angles_of(FLOWN)[::5]))


def by_clock(record, times):
    names = ("rates", "moment", "injected", "attitude")
    return replace(record, **{name: moved(getattr(record, name), times=times) for name in names})


@pytest.mark.parametrize("times", [0.9, 1.1])
def test_a_clock_ten_percent_off_is_named_by_the_attitude(whole, times):
    found = identify(by_clock(whole, times))
    assert not found.usable
    assert f"turned {times:.3g} times as far as by its attitude" in found.axes["roll"].why


def test_a_gyro_in_other_units_is_named_by_the_attitude(whole):
    found = identify(replace(whole, rates=replace(whole.rates, values=np.degrees(whole.rates.values))))
    assert "turned 57.3 times as far" in found.axes["roll"].why


@pytest.mark.parametrize("times", [0.98, 1.02])
def test_a_clock_a_little_off_is_no_reason(whole, times):
    assert identify(by_clock(whole, times), axes=("roll",)).usable == ("roll",)


def test_an_attitude_that_hardly_turns_tells_nothing(whole):
    still = replace(whole, attitude=replace(whole.attitude, values=1e-3 * whole.attitude.values))
    still = replace(still, rates=replace(still.rates, values=2e-3 * still.rates.values))
    assert "as far as by its attitude" not in identify(still, axes=("roll",)).axes["roll"].why


def test_a_gyro_that_answers_before_its_moment_is_named_and_the_other_axes_are_not_trusted(whole):
    found = identify(replace(whole, rates=moved(whole.rates, by=-0.02)), axes=("roll",)).axes["roll"]
    assert "ms before the moment that turns the aircraft" in found.why
    assert not found.usable
    assert found.mistaken


@pytest.mark.parametrize("seed", [1, 2])
def test_rotors_that_answer_by_their_inertia_are_not_too_early(seed):
    found = identify(record(fly([LEADING] * 3, 60, seed, band=(0.15, 40.0)), rate_setpoint=None), axes=("yaw",))
    assert found.usable == ("yaw",), found.axes["yaw"].why

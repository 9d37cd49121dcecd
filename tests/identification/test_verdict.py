"""What yields no model to design by, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest

from dob_companion.identification.identify import identify
from dob_companion.identification.record import Facts, Signal
from tests.identification.hovering import Axis, fly, record

HOVER = Axis(injected=0.0, wind=3.0)
SOURCE_KNOWS = {
    "ATC_RAT_RLL_P": 0.08, "ATC_RAT_RLL_I": 0.05, "ATC_RAT_RLL_D": 0.0, "ATC_RAT_RLL_FLTE": 0.0,
    "ATC_RAT_RLL_FLTD": 0.0, "ATC_ANG_RLL_P": 4.0, "SCHED_LOOP_RATE": 400.0, "INS_GYRO_FILTER": 0.0,
}  # fmt: skip
EXCITED = fly([Axis(wind=1.0)] * 3, 30, 11)
NEVER = Facts(np.zeros(1), np.zeros(1, bool))


def thinned(signal, step):
    return Signal(signal.time[::step], signal.values[::step])


def on_raster(signal, step, *, held):
    """Logged every `step` samples and put on the raster of all."""
    slow = thinned(signal, step)
    if held:
        return Signal(signal.time, np.repeat(slow.values, step, axis=0)[: len(signal.time)])
    return Signal(signal.time, np.column_stack([np.interp(signal.time, slow.time, each) for each in slow.values.T]))


def one_for_all(signal):
    return replace(signal, values=np.repeat(signal.values[:, :1], 3, axis=1))


def clipped(signal, most):
    return replace(signal, values=np.clip(signal.values, -most, most))


def refused(whole, axis="roll", **more):
    found = identify(whole, axes=(axis,), **more)
    assert found.usable == ()
    assert "\n" not in found.axes[axis].why
    return found.axes[axis].why


WHOLE = record(EXCITED)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"moment": thinned(WHOLE.moment, 5)}, "moment at 50 Hz is too slow"),
        ({"rates": thinned(WHOLE.rates, 10)}, "gyro at 25 Hz is too slow"),
        ({"armed": NEVER}, "disarmed throughout"),
        ({"flying": NEVER}, "never in flight"),
        ({"vehicle": "rover"}, "does not hover"),
        ({"vehicle": "plane"}, "does not hover"),
        ({"saturated": Facts(np.zeros(1), np.ones(1, bool))}, "saturated throughout"),
        ({"rates": replace(WHOLE.rates, values=-WHOLE.rates.values)}, "negative"),
        ({"rates": replace(WHOLE.rates, values=np.degrees(np.degrees(WHOLE.rates.values)))}, "are rates in rad/s"),
        ({"rates": replace(WHOLE.rates, values=np.roll(WHOLE.rates.values, 1, axis=1))}, "axes swapped"),
        ({"moment": replace(WHOLE.moment, values=np.roll(WHOLE.moment.values, 1, axis=1))}, "axes swapped"),
        ({"moment": replace(WHOLE.moment, values=0.0 * WHOLE.moment.values)}, "never changes"),
        ({"rates": replace(WHOLE.rates, values=np.where(WHOLE.rates.values > 1e9, 0.0, np.nan))}, "not finite"),
        ({"moment": on_raster(WHOLE.moment, 5, held=True)}, "moment at 250 Hz tells something new at 50 Hz only"),
        ({"rates": on_raster(WHOLE.rates, 10, held=False)}, "gyro at 250 Hz tells something new at 25 Hz only"),
        ({"moment": clipped(WHOLE.moment, 0.03)}, "the moment of roll stands at 0.03 for"),
        ({"rates": clipped(WHOLE.rates, 0.1)}, "the gyro of roll stands at 0.1 for"),
        ({"moment": replace(WHOLE.moment, values=np.sign(WHOLE.moment.values))}, "saturated throughout"),
        (
            {"injected": one_for_all(WHOLE.injected), "rate_setpoint": None},
            "roll and pitch were moved by one signal",
        ),
        ({"injected": None, "rate_setpoint": None}, "no excitation"),
        ({"make": "ArduPilot", "rates_filtered": False}, "INS_GYRO_FILTER is missing"),
    ],
)
def test_it_is_refused_with_the_reason(changes, words):
    assert words in refused(replace(WHOLE, **changes))


def test_a_record_of_holes_is_refused():
    kept = np.arange(len(WHOLE.rates.time)) % 500 < 490
    holed = Signal(WHOLE.rates.time[kept], WHOLE.rates.values[kept])
    assert "full of holes" in refused(replace(WHOLE, rates=holed))


def test_hover_in_wind_shows_the_controller_and_is_refused_with_and_without_its_gains():
    whole = record(fly([HOVER] * 3, 60, 12))
    assert "follows the aircraft" in refused(whole)
    known = replace(whole, make="ArduPilot", vehicle="quadrotor", rates_filtered=True, parameters=SOURCE_KNOWS)
    assert "-1/C" in refused(known)


def test_a_disturbance_observer_that_moves_the_moment_is_no_instrument():
    flight = fly([HOVER] * 3, 60, 13)
    slow = np.cumsum(flight.y, axis=0) * flight.dt
    whole = record(flight)
    fed_back = Signal(whole.rates.time, -0.05 * flight.y - 0.2 * slow)
    assert "injected signal follows the aircraft" in refused(replace(whole, injected=fed_back, rate_setpoint=None))


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_that_drowns_the_answer_is_not_taken_for_an_instrument_that_follows(seed):
    noisy = replace(Axis(), gain=113.0, pole=1.0, lag=0.05, p=0.15, i=0.2, injected=0.02, noise=0.14, wind=0.5)
    found = identify(record(fly([noisy] * 3, 30, seed, band=(0.3, 40.0)), rate_setpoint=None), axes=("roll",))
    assert "follows the aircraft" not in found.axes["roll"].why


def test_a_band_without_the_crossover_is_too_narrow():
    narrow = record(fly([Axis(wind=1.0)] * 3, 40, 14, band=(0.5, 2.5)), rate_setpoint=None)
    assert "are seen, up to" in refused(narrow)


def test_a_gain_that_changes_on_the_way_is_refused():
    first, second = (fly([Axis(wind=0.5, gain=gain)] * 3, 30, 15) for gain in (150.0, 300.0))
    both = replace(first, **{name: np.concatenate([getattr(first, name), getattr(second, name)])
                             for name in ("y", "u", "r", "asked", "rate_asked")})  # fmt: skip
    assert "differs between segments" in refused(record(both))


def test_an_unknown_filter_state_is_no_design():
    whole = replace(WHOLE, make="ArduPilot", parameters=SOURCE_KNOWS | {"INS_GYRO_FILTER": 20.0})
    assert "does not tell whether its rates have passed" in refused(whole)


@pytest.mark.parametrize("seconds", [0.05, 1.0, 4.1, 5.0, 7.0])
def test_short_records_are_answered_in_words(seconds):
    def cut(signal):
        kept = (signal.time >= 3.0) & (signal.time < 3.0 + seconds)
        return Signal(signal.time[kept], signal.values[kept])

    found = identify(replace(WHOLE, rates=cut(WHOLE.rates), moment=cut(WHOLE.moment)))
    assert all(one.why for one in found.axes.values())

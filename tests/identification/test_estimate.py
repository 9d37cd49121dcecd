"""The response and the model of an aircraft in closed loop, against its truth in closed form."""

import json

import numpy as np
import pytest

from dob_companion.identification.identify import identify
from tests.identification.hovering import Axis, fly, record

EXCITED = Axis(wind=3.0)
FLOWN = Axis(injected=0.0, pilot=0.1, wind=1.0)


@pytest.fixture(scope="module")
def windy():
    return identify(record(fly([EXCITED] * 3, 90, 1, coupling=0.1)))


def truth(axis, response):
    return axis.held(response.frequency, 1.0 / response.rate_hz)


def test_in_wind_the_direct_estimate_is_drawn_to_the_controller_and_the_instrument_is_not(windy):
    for result in windy.axes.values():
        response = result.response
        true, low = truth(EXCITED, response), response.frequency < 2.0 * np.pi * 4.0
        ours, direct = np.abs(response.value / true - 1.0), np.abs(response.direct / true - 1.0)
        assert np.median(direct[low]) > 0.15
        assert np.median(ours[low]) < 0.5 * np.median(direct[low])
        controller = EXCITED.p + (EXCITED.i + EXCITED.attitude * EXCITED.p) / (1j * response.frequency)
        assert np.all(np.abs(response.direct[low] + 1.0 / controller[low]) < np.abs(true[low] + 1.0 / controller[low]))


def test_the_bands_hold_the_truth_as_often_as_they_say():
    inside = []
    for seed in range(4):
        found = identify(record(fly([EXCITED] * 3, 40, seed)), axes=("roll",)).axes["roll"].response
        inside.append(np.abs(found.value - truth(EXCITED, found)) < found.band)
    assert 0.88 < np.mean(np.concatenate(inside)) < 0.995


def test_the_intervals_hold_the_truth_and_the_bound_the_true_response(windy):
    for result in windy.axes.values():
        model = result.model
        assert result.usable, result.why
        for interval, true in (
            (model.acceleration_per_unit, EXCITED.gain),
            (model.slow_pole_rad_s, EXCITED.pole),
            (model.lag_s, EXCITED.lag),
            (model.delay_s, EXCITED.delay),
        ):
            margin = 0.5 * (interval.high - interval.low)  # 95 % each, and there are twelve
            assert interval.low <= interval.value <= interval.high
            assert interval.low - margin < true < interval.high + margin
        w = np.geomspace(0.5, 300.0, 200)
        off = np.abs(EXCITED.held(w, 0.004) / model.response(w, 250.0) - 1.0)
        assert np.all(off <= model.bound.at(w / (2.0 * np.pi)))
        assert model.chi2 < 2.0
        assert model.held_out_chi2 < 2.5


def test_what_a_pilot_asks_is_an_instrument_as_well():
    found = identify(record(fly([FLOWN] * 3, 60, 3)))
    for result in found.axes.values():
        assert result.usable, result.why
        assert result.response.instrument == "attitude setpoint"
        gain = result.model.acceleration_per_unit
        margin = 0.5 * (gain.high - gain.low)  # 95 % each, and there are three
        assert gain.low - margin < FLOWN.gain < gain.high + margin
        assert gain.value == pytest.approx(FLOWN.gain, rel=0.1)


def test_axes_that_move_together_do_not_leak_into_each_other():
    weak, strong = Axis(wind=0.5), Axis(wind=0.5, injected=0.1)
    coupled = fly([weak, strong, strong], 60, 4, coupling=0.3)
    result = identify(record(coupled), axes=("roll",)).axes["roll"]
    off = np.abs(result.response.value / truth(weak, result.response) - 1.0)
    assert result.response.axes == ("roll", "pitch", "yaw")
    assert np.mean(off * np.abs(result.response.value) < result.response.band) > 0.85


@pytest.mark.parametrize("rate_hz", [100.0, 400.0])
def test_other_rates_serve_as_well(rate_hz):
    axis = Axis(wind=1.0)
    result = identify(record(fly([axis] * 3, 40, 5, rate_hz=rate_hz)), axes=("pitch",), rate_hz=rate_hz).axes["pitch"]
    assert result.model.acceleration_per_unit.value == pytest.approx(axis.gain, rel=0.05)
    assert result.model.delay_s.value == pytest.approx(axis.delay, abs=1.5e-3)


def test_a_lag_that_is_not_there_is_not_found_and_its_interval_starts_at_zero():
    axis = Axis(lag=0.0, delay=0.012, pole=0.0, wind=2.0, p=0.05)
    model = identify(record(fly([axis] * 3, 40, 7)), axes=("roll",)).axes["roll"].model
    assert model.structure == "integrator, delay"
    assert model.lag_s.low == model.lag_s.value == model.slow_pole_rad_s.value == 0.0
    assert model.lag_s.high > 0.0
    assert model.delay_s.low < axis.delay < model.delay_s.high


def test_the_json_is_plain_numbers_and_words(windy):
    whole = json.loads(json.dumps(windy.to_object()))["axes"]["roll"]
    assert set(whole) == {
        "acceleration_per_unit", "slow_pole_rad_s", "lag_s", "lead_s", "delay_s", "usable", "why", "gyro_filter",
        "modes",
    }  # fmt: skip
    assert set(whole["delay_s"]) == {"value", "low", "high"}


def test_a_chirp_that_passes_each_frequency_once_serves_axis_by_axis():
    n, each = 90 * 250, 28 * 250
    moved, t = np.zeros((n, 3)), np.arange(each) / 250.0
    for axis in range(3):
        begin = (1 + 29 * axis) * 250
        phase = 2.0 * np.pi * 0.3 * 28.0 / np.log(100.0) * (100.0 ** (t / 28.0) - 1.0)  # 0.3 to 30 Hz
        moved[begin : begin + each, axis] = np.sin(phase) * np.minimum(1.0, 5.0 * np.minimum(t, 28.0 - t))
    found = identify(record(fly([Axis(wind=1.0)] * 3, 90, 8, moved=moved)))
    for result in found.axes.values():
        assert result.usable, result.why
        assert result.model.acceleration_per_unit.low < 250.0 < result.model.acceleration_per_unit.high
        assert result.response.frequency[-1] > 2.0 * np.pi * 20.0
    assert next(one.axes for one in found.segments if one.axes) == ("roll",)

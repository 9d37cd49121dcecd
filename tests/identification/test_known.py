"""Gyro filters: the model is of what the link shows, whichever rate the record holds."""

from dataclasses import replace

import numpy as np
import pytest

from dob_companion.identification.identify import identify
from tests.identification.hovering import Axis, fly, record

ARDUPILOT = {
    "ATC_RAT_PIT_P": 0.08, "ATC_RAT_PIT_I": 0.05, "ATC_RAT_PIT_D": 0.0, "ATC_RAT_PIT_FLTE": 0.0,
    "ATC_RAT_PIT_FLTD": 0.0, "ATC_RAT_RLL_P": 0.08, "ATC_ANG_RLL_P": 4.0, "SCHED_LOOP_RATE": 400.0,
    "INS_GYRO_FILTER": 20.0,
}  # fmt: skip
PX4 = {
    "MC_ROLLRATE_P": 0.08, "MC_PITCHRATE_P": 0.08, "MC_PITCHRATE_I": 0.05, "MC_PITCHRATE_D": 0.0,
    "MC_PITCHRATE_K": 1.0, "MC_ROLL_P": 4.0, "IMU_GYRO_CUTOFF": 20.0, "IMU_DGYRO_CUTOFF": 20.0,
    "IMU_GYRO_RATEMAX": 400.0, "IMU_INTEG_RATE": 200.0,
}  # fmt: skip
BARE = Axis(gain=220.0, lag=0.03, delay=0.005, wind=0.5)


def butterworth(s):
    w = 2.0 * np.pi * 20.0
    return 1.0 / (1.0 + np.sqrt(2.0) * s / w + (s / w) ** 2)


SEEN = {True: replace(BARE, shape=butterworth, p=0.05), False: replace(BARE, p=0.05)}
FLIGHTS = {filtered: fly([SEEN[filtered]] * 3, 40, 21) for filtered in SEEN}


@pytest.mark.parametrize(
    ("make", "parameters", "filtered", "on_the_link"),
    [
        ("ArduPilot", ARDUPILOT, True, True),
        ("ArduPilot", ARDUPILOT, False, True),
        ("PX4", PX4, True, False),
        ("PX4", PX4, False, False),
    ],
)
def test_the_model_is_what_the_link_shows(make, parameters, filtered, on_the_link):
    flown = record(FLIGHTS[filtered])
    whole = replace(flown, make=make, vehicle="quadrotor", rates_filtered=filtered, parameters=parameters)
    found = identify(whole, axes=("pitch",))
    model = found.axes["pitch"].model
    late = 0.0025 if make == "PX4" and filtered else 0.0  # the streamed rate is a mean over 5 ms
    assert found.usable == ("pitch",)
    assert model.lag_s.value == pytest.approx(BARE.lag, abs=0.003)
    assert model.delay_s.value == pytest.approx(BARE.delay + late, abs=0.001)
    assert bool(model.about_filters and "INS_GYRO_FILTER = 20 Hz" in model.about_filters[0]) == on_the_link
    w = 2.0 * np.pi * np.geomspace(2.0, 20.0, 20)
    truth = replace(SEEN[on_the_link], delay=BARE.delay + late).held(w, 0.004)
    assert np.all(np.abs(model.response(w, 250.0) / truth - 1.0) < 0.1)
    converted = any("gyro filter is" in line for line in found.remarks)
    assert converted == (filtered != on_the_link)


def test_an_ardupilot_link_without_parameters_shows_the_filter_as_lag_and_delay():
    whole = replace(record(FLIGHTS[True]), make="ArduPilot", vehicle="quadrotor", rates_filtered=True)
    found = identify(whole, axes=("pitch",))
    model = found.axes["pitch"].model
    assert model.lag_s.value + model.delay_s.value > BARE.lag + BARE.delay + 0.008
    assert model.about_filters == ()
    assert any("part of lag and delay" in line for line in found.remarks)

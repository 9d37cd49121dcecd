"""One flight of a campaign, without processes."""

from dataclasses import replace
from math import log

import numpy as np
import pytest

from sitl.airframe.linear import PITCH
from sitl.airframe.surroundings import STILL
from sitl.campaign.pilot import Job, aircraft_of, fly, fly_row, row_of
from sitl.campaign.plan import Inputs
from sitl.constants import DT
from sitl.log import ON_WINDOW
from sitl.scenario.spec import load

NOMINAL = Inputs(0, 3, "linear", "paper", 1, 1.0, 1.0)


@pytest.fixture
def job(design, short):
    return Job(NOMINAL, load(str(short)), (0.02, 0.02, 0.02), design.read_text(), {})


def test_without_a_link_the_correction_acts_in_the_sample_that_it_answers(job):
    craft = fly(replace(job, inputs=NOMINAL._replace(delay=0)))
    arrays = craft.flight.log.arrays()
    on = arrays["window"] == ON_WINDOW
    assert set(arrays["age"][on]) == {0}
    assert arrays["answered"].all()
    assert craft.onboard.state.name == "ACTIVE"
    assert np.any(arrays["correction"][on])


def test_each_further_sample_of_delay_leaves_more_of_the_disturbance(job):
    rows = [fly_row(replace(job, inputs=NOMINAL._replace(delay=delay))) for delay in (0, 1, 2)]
    assert [row["delay_samples"] for row in rows] == [0, 1, 2]
    off, on = ([row[f"rms_{window}_pitch"] for row in rows] for window in ("off", "on"))
    assert off[0] == off[1] == off[2]
    assert on[0] < on[1] < on[2]


def test_gain_and_pole_change_the_plant_as_they_say():
    """After a step of torque the rate's growth settles at the gain's; the lag's time constant is 1 / corner."""
    rates = []
    for inputs in (NOMINAL, NOMINAL._replace(gain=0.5), NOMINAL._replace(pole=2.0)):
        airframe, history = aircraft_of(inputs).airframe, []
        airframe.on_ground, airframe.altitude = False, 1000.0
        for _ in range(1000):
            airframe.advance((0.0, 1e-6, 0.0), 0.5, STILL)
            history.append(airframe.rate[1])
        rates.append(np.array(history))
    growth = [rate[-1] - rate[-2] for rate in rates]
    assert growth[1] == pytest.approx(0.5 * growth[0], rel=1e-9)
    assert growth[2] == pytest.approx(growth[0], rel=1e-9)
    behind = [len(rate) - rate[-1] / grown for rate, grown in zip(rates, growth, strict=True)]
    lag_s = [-DT / log(PITCH.pole), -DT / log(PITCH.pole) / 2.0]
    assert behind[0] - behind[2] == pytest.approx((lag_s[0] - lag_s[1]) / DT, abs=0.02)


def test_a_vehicle_that_comes_down_is_a_failed_flight_and_says_why(job):
    hopeless = replace(job, scale=(2.0, 2.0, 2.0))
    row = row_of(hopeless, fly(hopeless))
    assert (row["outcome"], row["reason"]) == ("failed", "the vehicle came down before the flight was complete")
    assert "rms_on_pitch" not in row


def test_a_companion_held_back_injects_nothing_and_says_why(job):
    row = fly_row(replace(job, parameters={"DOB_LIMIT": 0.0}))
    assert (row["injecting"], row["max_correction_pitch"]) == (0.0, 0.0)
    late = fly_row(replace(job, inputs=NOMINAL._replace(delay=9)))
    assert (late["outcome"], late["injecting"], late["state"]) == ("complete", 0.0, "TRACKING")
    assert late["reason"] == "delay 9 samples above 2"


def test_the_tailsitter_flies_in_the_wind_that_it_is_given(job):
    windy = NOMINAL._replace(airframe="tailsitter", wind_m_s=3.0)
    craft = fly(replace(job, inputs=windy, scale=(0.005, 0.005, 0.005)))
    assert not craft.failure
    wind = craft.flight.log.arrays()["wind"]
    blowing = wind[np.any(wind != 0.0, axis=1)]
    assert np.abs(blowing.mean(axis=0)[:2]).max() == pytest.approx(3.0, rel=0.3)
    assert blowing.std(axis=0).min() > 0.05

"""A record on a uniform grid: stamps that step, moments between samples, holes."""

from dataclasses import replace

import numpy as np
import pytest

from dob_companion.identification.grid import gridded
from dob_companion.identification.identify import identify
from dob_companion.identification.record import Record, Signal
from tests.identification.hovering import Axis, fly, record


def signal(time, values):
    return Signal(np.asarray(time, float), np.repeat(np.asarray(values, float)[:, None], 3, axis=1))


@pytest.mark.parametrize(("gyro_hz", "highest_hz"), [(250.0, 100.0), (150.0, 60.0), (1000.0, 100.0)])
def test_no_more_is_looked_at_than_the_slower_signal_shows(gyro_hz, highest_hz):
    time = np.arange(0.0, 0.5, 1.0 / gyro_hz)
    moment = signal(np.arange(0.0, 0.5, 0.004), np.arange(125) % 2)
    grid = gridded(Record(source="", rates=signal(time, time), moment=moment), 250.0)
    assert grid.highest_hz == pytest.approx(highest_hz)


def test_a_moment_counts_by_the_time_it_acts_and_a_rate_lies_between_its_neighbours():
    time = np.arange(0.0, 0.2, 0.005)
    moment = signal(np.arange(0.001, 0.2, 0.004), np.arange(50) % 2)
    grid = gridded(Record(source="", rates=signal(time, 10.0 * time), moment=moment), 250.0)
    np.testing.assert_allclose(grid.rates[:, 0], 10.0 * grid.time)
    assert grid.begin == 0.005  # the first stamp of the gyro at which a moment acts
    begins_in = (np.arange(len(grid.time)) + 1) % 2  # 0.005 s is where the second moment (1) begins
    np.testing.assert_allclose(grid.moment[:, 0], begins_in, atol=1e-12)
    between = gridded(Record(source="", rates=signal(time + 0.002, time), moment=moment), 250.0)
    np.testing.assert_allclose(between.moment[:4, 0], [0.25, 0.75, 0.25, 0.75])


def test_holes_are_left_out_and_reported():
    flight = record(fly([Axis(wind=0.5)] * 3, 60, 31))
    kept = (flight.rates.time < 20.0) | (flight.rates.time > 21.0)
    holed = replace(flight, rates=Signal(flight.rates.time[kept], flight.rates.values[kept]))
    found = identify(holed, axes=("roll",))
    assert found.usable == ("roll",)
    assert found.axes["roll"].model.chi2 < 2.0  # a line across the hole would be seen
    assert any("1 hole, the longest of 1 s" in line for line in found.remarks)
    used = [(one.begin, one.end) for one in found.segments if one.axes]
    assert all(end <= 20.1 or begin >= 20.9 for begin, end in used)
    assert next(one.why for one in found.segments if one.why) == "samples are missing"


def test_stamps_in_steps_of_two_and_a_half_and_five_ms_serve():
    axis = Axis(wind=0.5)
    flight = record(fly([axis] * 3, 40, 32, rate_hz=400.0))
    kept = np.arange(len(flight.rates.time)) % 8 % 3 != 2  # steps 1 2 1 2 2 …, 250 Hz
    stepping = replace(flight, rates=Signal(flight.rates.time[kept], flight.rates.values[kept]))
    found = identify(stepping, axes=("roll",))
    model = found.axes["roll"].model
    assert found.usable == ("roll",)
    assert model.acceleration_per_unit.value == pytest.approx(axis.gain, rel=0.03)
    assert model.delay_s.value + model.lag_s.value == pytest.approx(axis.delay + axis.lag, abs=0.002)
    assert any("steps of 2.5 to 5 ms" in line for line in found.remarks)

"""Gyro and stamps."""

import numpy as np
import pytest

from sitl.attitude import ZERO
from sitl.autopilot.imu import COARSE, FINE, Gyro, Stamps


def test_a_perfect_gyro_reads_the_rate():
    assert Gyro().read((0.1, -0.2, 0.3), ZERO) == (0.1, -0.2, 0.3)


def test_bias_and_noise_are_added():
    assert Gyro(bias=(0.01, 0.0, -0.01)).read((0.1, 0.2, 0.3), (1e-3, 2e-3, 3e-3)) == pytest.approx(
        (0.111, 0.202, 0.293)
    )


@pytest.mark.parametrize("quantum", [FINE, COARSE])
def test_a_reading_is_the_nearest_step(quantum):
    reading = Gyro(quantum=quantum).read((0.1234567, -2.0, 0.0), ZERO)
    for got, true in zip(reading, (0.1234567, -2.0, 0.0), strict=True):
        assert abs(got - true) <= 0.5 * quantum
        assert got / quantum == pytest.approx(round(got / quantum), abs=1e-6)


@pytest.mark.parametrize("latency", [0.25, 1.0, 2.5])
def test_a_late_gyro_reads_the_past(latency):
    gyro = Gyro(latency=latency)
    ramp = [gyro.read((0.01 * k, 0.0, -0.02 * k), ZERO) for k in range(20)]
    assert ramp[-1] == pytest.approx((0.01 * (19 - latency), 0.0, -0.02 * (19 - latency)))


def test_latency_can_begin_and_end_in_flight():
    gyro = Gyro()
    gyro.read((1.0, 1.0, 1.0), ZERO)
    gyro.latency = 1.0
    gyro.read((2.0, 2.0, 2.0), ZERO)
    assert gyro.read((3.0, 3.0, 3.0), ZERO) == (2.0, 2.0, 2.0)
    gyro.latency = 0.0
    assert gyro.read((4.0, 4.0, 4.0), ZERO) == (4.0, 4.0, 4.0)


TIMES = range(10_000_000, 12_000_000, 4000)


def test_plain_stamps_are_the_time():
    stamps = Stamps(1)
    assert [stamps.stamp(t) for t in TIMES] == list(TIMES)


def test_a_400_hertz_loop_stamps_in_steps_of_2500_and_5000_microseconds():
    stamps = Stamps(1, grid_us=2500)
    steps = np.diff([stamps.stamp(t) for t in TIMES])
    assert set(steps) == {2500, 5000}
    assert steps.mean() == pytest.approx(4000, rel=0.01)


def test_jitter_and_skew_are_as_large_as_asked_and_stamps_increase():
    stamps = Stamps(1, jitter_us=300.0, skew_ppm=4000.0)
    made = np.array([stamps.stamp(t) for t in TIMES])
    assert (np.diff(made) > 0).all()
    assert np.std(made - np.array(TIMES) * 1.004) == pytest.approx(300.0, rel=0.2)


def test_the_same_seed_makes_the_same_stamps():
    one, other = (Stamps(5, jitter_us=500.0) for _ in range(2))
    assert [one.stamp(t) for t in TIMES] == [other.stamp(t) for t in TIMES]

"""What the companion shows of a vehicle that has gone."""

import math

import pytest

from dob_companion.companion.obeyed import SILENCE_S
from dob_companion.supervisor.monitors import UNKNOWN_AGE
from tests.companion.aircraft import DT, aircraft, corrections


def wait(plane, seconds):
    """Time passes without a word of the vehicle; returns what was said."""
    said = []
    for _ in range(math.ceil(seconds / DT)):
        plane.now += DT
        said += plane.listen()
    return said


def telemetry(messages):
    return [m for m in messages if m.get_type() == "DEBUG_FLOAT_ARRAY"]


def test_a_vehicle_that_has_gone_has_no_rate_no_estimate_and_no_delay_and_it_is_said_since_when():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    alive = plane.companion.status()
    assert (alive.rate_hz, alive.delay_samples, alive.heard_s) == (pytest.approx(250.0), 1, 0.0)
    assert alive.d_hat[0] == -alive.correction[0] == pytest.approx(0.2)
    said = wait(plane, 15.0)
    gone = plane.companion.status()
    assert (gone.rate_hz, gone.delay_samples, gone.delay_p95_samples) == (0.0, UNKNOWN_AGE, UNKNOWN_AGE)
    assert gone.d_hat == gone.correction == (0.0, 0.0, 0.0)
    assert gone.heard_s == pytest.approx(15.0, abs=2 * DT)
    assert gone.round_trip_s is None
    told = telemetry(said)
    assert 12 <= len(told) <= 15  # once a second from the silence on
    assert list(told[-1].data[:9]) == [0, 0, 0, 0, 0, 0, gone.state, UNKNOWN_AGE, 0]


def test_the_correction_shown_is_the_one_that_was_sent_last_whatever_becomes_of_the_vehicle():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    for _ in range(round(3 * SILENCE_S / DT)):
        plane.now += DT
        plane.listen()
        newest = corrections(plane.said)[-1]
        assert plane.companion.status().correction == pytest.approx((newest.x, newest.y, newest.z))


def test_a_vehicle_that_talks_but_has_stopped_its_gyro_is_heard_and_has_no_rate():
    plane = aircraft().active()
    for _ in range(3):
        wait(plane, 1.0)
        plane.heartbeat()
    status = plane.companion.status()
    assert (status.rate_hz, status.heard_s) == (0.0, 0.0)
    assert status.why == "no samples"


def test_before_any_vehicle_there_is_nothing_to_say():
    assert aircraft().companion.status().heard_s is None


def test_when_samples_come_again_so_do_rate_and_estimate():
    plane = aircraft().active()
    wait(plane, 15.0)
    plane.sample += round(15.0 / DT)
    plane.pairs(600)
    status = plane.companion.status()
    assert status.rate_hz == pytest.approx(250.0)
    assert status.delay_samples == 1
    assert status.heard_s == 0.0

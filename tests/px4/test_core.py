"""What deploy/px4 adds to the torque setpoint, and when: the core of the module itself, compiled and stepped."""

import math
import struct

import numpy as np
import pytest

from tests.px4.core import COMPILER, MALFORMED, OUT_OF_ORDER, OUT_OF_TIME, TAKEN, Flight, compiled

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler (g++ or clang++) to compile the core with")

ZERO = (0.0, 0.0, 0.0)
MOMENT = (0.04, -0.03, 0.02)


@pytest.fixture(scope="module")
def core(tmp_path_factory):
    return compiled(tmp_path_factory.mktemp("core"))


@pytest.fixture
def flight(core):
    return Flight(core)


@pytest.fixture
def ready(flight):
    """A companion has been heard for two seconds: the gate is open, all limits are in force."""
    flight.converse(2.0, *ZERO)
    return flight


def close(a, b, tolerance=1e-6):
    return np.allclose(a, b, rtol=0.0, atol=tolerance)


def test_a_correction_is_added_to_every_axis_exactly(ready):
    ready.converse(0.01, *MOMENT)
    assert close(ready.added, MOMENT)


def test_without_a_correction_nothing_is_added(flight):
    flight.run(1.0)
    assert flight.added == ZERO
    assert not flight.fresh
    assert flight.age_us == -1.0


def test_it_comes_in_over_half_a_second(flight):
    flight.limits = (0.5, 0.5, 0.5)
    flight.converse(0.25, 0.02, 0.0, 0.0)
    assert flight.added[0] == pytest.approx(0.01, rel=0.03)
    flight.converse(0.3, 0.02, 0.0, 0.0)
    assert flight.added[0] == pytest.approx(0.02)


def test_every_axis_is_clipped_at_its_limit(ready):
    ready.limits = (0.15, 0.15, 0.05)
    ready.converse(1.0, 1.0, -1.0, 1.0)
    assert close(ready.added, (0.15, -0.15, 0.05))


def test_a_changed_limit_is_moved_to_slowly(ready):
    ready.converse(0.01, 1.0, 0.0, 0.0)
    ready.limits = (0.5, 0.5, 0.5)
    begin = ready.added[0]
    ready.converse(0.5, 1.0, 0.0, 0.0)
    assert ready.added[0] == pytest.approx(begin + 0.1, rel=0.02)


@pytest.mark.parametrize("limit", [-0.1, 0.6, math.nan, math.inf])
def test_a_limit_out_of_its_range_changes_nothing(ready, limit):
    ready.converse(0.01, 1.0, 0.0, 0.0)
    ready.limits = (limit, limit, limit)
    ready.converse(1.0, 1.0, 0.0, 0.0)
    assert ready.added[0] == pytest.approx(0.15)


def test_in_silence_the_last_one_holds_for_a_tenth_and_is_gone_after_another(ready):
    ready.converse(0.02, *MOMENT)
    silent_from, ready.history = ready.now_us - 4000, []
    ready.run(0.4, 1000)
    times, roll = np.array(ready.history).T
    since = 1e-6 * (times - silent_from)
    assert close(roll[since < 0.0999], MOMENT[0])
    assert np.all(roll[since > 0.202] == 0.0)
    assert np.all(np.diff(roll) <= 0.0)
    assert np.max(-np.diff(roll)) < 0.02 * MOMENT[0]


def test_after_silence_it_comes_back_no_faster_than_in_half_a_second(ready):
    ready.converse(0.02, *MOMENT)
    ready.run(0.4)
    ready.history = []
    ready.converse(0.6, *MOMENT)
    roll = np.array(ready.history)[:, 1]
    assert np.max(np.diff(roll)) < 1.1 * MOMENT[0] * 0.002 / 0.5
    assert roll[-1] == pytest.approx(MOMENT[0])


def test_when_something_speaks_against_it_it_is_gone_within_a_tenth(ready):
    ready.converse(0.02, *MOMENT)
    ready.let_in = False
    ready.converse(0.06, *MOMENT)
    assert 0.0 < ready.added[0] < MOMENT[0]
    ready.converse(0.05, *MOMENT)
    assert ready.added == ZERO


@pytest.mark.parametrize(("thrust", "share"), [(0.0, 0.0), (0.05, 0.0), (0.075, 0.5), (0.1, 1.0), (1.0, 1.0)])
def test_near_zero_thrust_nothing_is_added(ready, thrust, share):
    ready.thrust = thrust
    ready.converse(0.02, *MOMENT)
    assert close(ready.added, np.multiply(share, MOMENT))


def test_a_thrust_that_is_not_a_number_lets_nothing_in(ready):
    ready.thrust = math.nan
    ready.converse(0.02, *MOMENT)
    assert ready.added == ZERO


def test_after_a_standstill_of_the_rate_controller_it_begins_again_from_zero(ready):
    ready.converse(0.02, *MOMENT)
    ready.now_us += 150_000
    ready.hear(*MOMENT)
    ready.cycle()
    assert ready.added == ZERO


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1.0001, -2.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_is_not_a_moment_changes_nothing(ready, bad, axis):
    ready.converse(0.02, *MOMENT)
    moment = list(MOMENT)
    moment[axis] = bad
    assert ready.hear(*moment, age_us=1) == MALFORMED
    ready.run(0.004)
    assert close(ready.added, MOMENT)


@pytest.mark.parametrize("size", [0, 1, 19, 21, 128])
def test_another_size_is_not_a_correction(ready, size):
    assert ready.hear_bytes(struct.pack("<Q3f", ready.now_us, *MOMENT).ljust(128, b"\0")[:size]) == MALFORMED


def test_the_newest_stamp_counts_and_none_counts_twice(ready):
    stamp = ready.now_us - 2000
    assert ready.hear(*MOMENT, stamp_us=stamp) == TAKEN
    for old in (stamp, stamp - 1000):
        assert ready.hear(0.0, 0.0, 0.0, stamp_us=old) == OUT_OF_ORDER
    ready.run(0.0025)
    assert close(ready.added, MOMENT)


@pytest.mark.parametrize("age_us", [-1, -1_000_000, 100_001, 10_000_000])
def test_a_stamp_of_the_future_or_of_long_ago_is_not_taken_up(flight, age_us):
    assert flight.hear(*MOMENT, age_us=age_us) == OUT_OF_TIME
    assert not flight.fresh


def test_the_age_is_that_of_the_gyro_sample_and_ends_with_the_fade(ready):
    ready.hear(*MOMENT, age_us=3000)
    assert ready.age_us == 3000.0
    ready.run(0.19)
    assert ready.age_us == pytest.approx(193_000.0)
    ready.run(0.02)
    assert ready.age_us == -1.0

"""Taking up a correction: the rules of docs/interfaces.md, one by one."""

import math

import pytest

from sitl.airframe.surroundings import STILL, Surroundings
from sitl.autopilot.aircraft import linear
from sitl.autopilot.correction import CorrectionInput, Verdict
from sitl.autopilot.vehicle import START_US, Vehicle
from sitl.constants import DT_US

NOW = 20_000_000
VALUE = (0.1, -0.2, 0.3)


def taken(stamp: int = NOW, value: tuple[float, float, float] = VALUE, now: int = NOW) -> CorrectionInput:
    corrections = CorrectionInput()
    assert corrections.offer(stamp, value, now) is Verdict.TAKEN
    return corrections


def test_without_any_correction_there_is_none():
    assert CorrectionInput().at(NOW) == ((0.0, 0.0, 0.0), None)


def test_the_newest_stamp_wins_whatever_the_order_of_arrival():
    corrections = taken(NOW - 4000)
    assert corrections.offer(NOW, (0.5, 0.5, 0.5), NOW) is Verdict.TAKEN
    assert corrections.offer(NOW - 8000, VALUE, NOW) is Verdict.NOT_NEWER
    assert corrections.at(NOW + 4000) == ((0.5, 0.5, 0.5), NOW)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("bad", "verdict"),
    [
        (math.nan, Verdict.NOT_FINITE),
        (math.inf, Verdict.NOT_FINITE),
        (-math.inf, Verdict.NOT_FINITE),
        (1.0000001, Verdict.TOO_LARGE),
        (-1.5, Verdict.TOO_LARGE),
    ],
)
def test_one_bad_axis_spoils_the_whole_message(axis, bad, verdict):
    corrections = taken()
    value = [0.0, 0.0, 0.0]
    value[axis] = bad
    assert corrections.offer(NOW + 4000, tuple(value), NOW + 4000) is verdict
    assert corrections.at(NOW + 4000) == (VALUE, NOW)


def test_the_largest_correction_allowed_is_one():
    assert taken(value=(1.0, -1.0, 0.0)).at(NOW)[0] == (1.0, -1.0, 0.0)


def test_a_stamp_twice_is_not_news():
    corrections = taken()
    assert corrections.offer(NOW, (0.0, 0.0, 0.0), NOW + 90_000) is Verdict.NOT_NEWER
    assert corrections.at(NOW + 150_000)[0] == pytest.approx(tuple(0.5 * v for v in VALUE))


def test_a_stamp_from_the_future_is_ignored():
    corrections = CorrectionInput()
    assert corrections.offer(NOW + 1, VALUE, NOW) is Verdict.FUTURE
    assert corrections.at(NOW) == ((0.0, 0.0, 0.0), None)


def test_silence_is_held_for_100_ms_then_faded_linearly_within_100_ms():
    corrections = taken()
    for after_ms, share in ((0, 1.0), (100, 1.0), (125, 0.75), (150, 0.5), (196, 0.04), (200, 0.0), (5000, 0.0)):
        value, _ = corrections.at(NOW + 1000 * after_ms)
        assert value == pytest.approx(tuple(share * v for v in VALUE)), after_ms
    assert corrections.at(NOW + 196_000)[1] == NOW
    assert corrections.at(NOW + 200_000)[1] is None


def test_news_after_a_fade_acts_at_once():
    corrections = taken()
    corrections.offer(NOW + 400_000, (0.2, 0.2, 0.2), NOW + 400_000)
    assert corrections.at(NOW + 404_000) == ((0.2, 0.2, 0.2), NOW + 400_000)


def flying() -> Vehicle:
    vehicle = Vehicle(linear())
    vehicle.arm()
    vehicle.take_off(2.0)
    for _ in range(500):
        vehicle.step(STILL, (0.0, 0.0, 0.0), CorrectionInput())
    return vehicle


def test_an_answer_to_the_newest_sample_acts_one_sample_later_and_its_age_says_so():
    vehicle, corrections = flying(), CorrectionInput()
    corrections.offer(vehicle.now_us, VALUE, vehicle.now_us)
    first, second = (vehicle.step(STILL, (0.0, 0.0, 0.0), corrections) for _ in range(2))
    assert (first.correction, first.age, second.age) == (VALUE, 1, 2)
    assert first.u_e == pytest.approx(VALUE, abs=1e-6)
    assert first.stamp_us == vehicle.now_us - DT_US


def test_a_zero_correction_has_an_age_and_no_correction_has_none():
    vehicle, corrections = Vehicle(linear()), CorrectionInput()
    assert vehicle.step(STILL, (0.0, 0.0, 0.0), corrections).age == -1
    corrections.offer(START_US, (0.0, 0.0, 0.0), START_US)
    assert vehicle.step(STILL, (0.0, 0.0, 0.0), corrections).age == 1


def test_u_e_holds_the_correction_and_is_saturated():
    vehicle, corrections = flying(), CorrectionInput()
    for _ in range(40):  # push until controller and correction together exceed the limit
        corrections.offer(vehicle.now_us, (1.0, -1.0, 1.0), vehicle.now_us)
        sample = vehicle.step(Surroundings((-0.5, 0.5, -0.5)), (0.0, 0.0, 0.0), corrections)
        assert max(map(abs, sample.u_e)) <= 1.0
        assert sample.correction == (1.0, -1.0, 1.0)

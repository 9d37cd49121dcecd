"""Why nothing is injected although it is switched on, or less is gained than designed for: each reason is said once,
however often they take turns."""

from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import CompanionConfig, parse_config
from dob_companion.companion.waiting import PATIENCE_S, Waiting
from dob_companion.supervisor import State
from tests.companion.aircraft import DT, aircraft, texts

STANDS = round((PATIENCE_S + 2.0) / DT)
GROUND = (mav.MAV_LANDED_STATE_ON_GROUND, mav.MAV_VTOL_STATE_MC)
AIR = (mav.MAV_LANDED_STATE_IN_AIR, mav.MAV_VTOL_STATE_MC)


def waited_for(plane):
    return [text for text in texts(plane.said) if text.startswith("DOB TRACKING: ")]


def test_the_reasons_of_one_wait_are_each_said_once_and_again_when_it_has_injected_in_between():
    plane = aircraft(parse_config("[regime]\nkill_channel = 7", "test"))
    released, killed = [1000] * 18, [2000] * 18
    plane.armed, plane.flight, plane.pulses = False, GROUND, released
    plane.pairs(600)
    plane.write("DOB_ENABLE", 1.0)
    for armed, flight, pulses in 2 * [(False, GROUND, released), (True, GROUND, released), (True, AIR, killed)]:
        plane.armed, plane.flight, plane.pulses = armed, flight, pulses
        plane.pairs(STANDS)
        assert plane.companion.status().state is State.TRACKING
    first = waited_for(plane)
    assert len(first) == len(set(first)) == 4  # "data are good" among them
    assert {"not armed", "on the ground"} < {text.removeprefix("DOB TRACKING: ") for text in first}
    plane.pulses = released
    plane.until(State.ACTIVE)
    plane.armed = False
    plane.pairs(STANDS + 500)
    assert waited_for(plane)[len(first) :].count("DOB TRACKING: data are good") == 1


def test_corrections_that_come_later_than_designed_are_told_of_once_for_each_switching_on():
    plane = aircraft(CompanionConfig())
    plane.pairs(600)
    plane.write("DOB_ENABLE", 1.0)
    plane.until(State.ACTIVE)
    for at_first, later, told in ((1.0, 2.0, 1), (2.0, 2.0, 1)):  # and after another fade of the same flight
        plane.age = at_first
        plane.pairs(STANDS)
        plane.age = later
        plane.pairs(STANDS + 600)
        assert texts(plane.said).count("DOB: delay p95 2 samples, designed for 1") == told
        plane.armed = False
        plane.until(State.TRACKING)
        plane.armed = True
        plane.until(State.ACTIVE)
    plane.write("DOB_ENABLE", 0.0)
    plane.pairs(STANDS)
    plane.write("DOB_ENABLE", 1.0)
    plane.until(State.ACTIVE)
    plane.pairs(STANDS)
    assert texts(plane.said).count("DOB: delay p95 2 samples, designed for 1") == 2


def test_a_reason_that_passes_within_its_patience_is_not_said():
    plane = aircraft(CompanionConfig())
    plane.armed = False
    plane.pairs(600)
    plane.write("DOB_ENABLE", 1.0)
    plane.pairs(round(0.5 * PATIENCE_S / DT))
    plane.armed = True
    plane.until(State.ACTIVE)
    assert waited_for(plane) == ["DOB TRACKING: data are good"]


def test_the_same_reason_with_other_numbers_is_no_news():
    waiting = Waiting()
    said = [waiting.news(f"rate {200 + k} Hz below 237.5", 0.1 * k) for k in range(100)]
    assert [words for words in said if words] == [f"rate {200 + 10 * PATIENCE_S:.0f} Hz below 237.5"]
    assert [waiting.news("not armed", 10.0 + k) for k in range(5)] == ["", "", "", "not armed", ""]
    assert [waiting.news("rate 180 Hz below 237.5", 15.0 + k) for k in range(5)] == [""] * 5
    waiting.over()
    assert waiting.news("not armed", 20.0) == ""
    assert waiting.news("not armed", 20.0 + PATIENCE_S) == "not armed"

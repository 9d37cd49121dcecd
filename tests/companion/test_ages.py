"""Every fact that safety rests on has an age and an end (docs/interfaces.md, How long a fact counts)."""

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import Companion, parse_config
from dob_companion.supervisor import State, ages
from tests.companion.aircraft import DT, Aircraft, aircraft, small_design, texts

IN_AIR = mav.MAV_LANDED_STATE_IN_AIR, mav.MAV_VTOL_STATE_MC
HERE = [1500] * 18


def with_kill_switch():
    config = parse_config("[regime]\nkill_channel = 7", "c.toml")
    return Aircraft(Companion(small_design(), config))


def fly(plane, seconds):
    plane.pairs(round(seconds / DT))
    return plane.companion.status().state


def test_a_kill_switch_that_is_no_longer_heard_fades_it_out_until_it_is_heard_again():
    plane = with_kill_switch()
    plane.pulses = HERE
    plane.active()
    plane.pulses = None
    assert fly(plane, ages.KILL_SWITCH_S - 0.25) is State.ACTIVE
    assert fly(plane, 0.3) is State.RAMP_OUT
    assert "DOB RAMP_OUT: kill switch not heard, RC channel 7" in texts(plane.said)
    assert fly(plane, 5.0) is State.TRACKING
    plane.pulses = HERE
    plane.until(State.ACTIVE)


def test_a_kill_switch_that_was_never_heard_forbids_injecting_and_that_is_said():
    plane = with_kill_switch()
    plane.pairs(600)
    plane.write("DOB_ENABLE", 1.0)
    assert fly(plane, 6.0) is State.TRACKING
    assert "DOB TRACKING: kill switch not heard, RC channel 7" in texts(plane.said)


@pytest.mark.parametrize("absent", [0, 65535])
def test_a_message_without_the_kill_switchs_channel_is_no_news_of_it(absent):
    plane = with_kill_switch()
    plane.pulses = HERE
    plane.active()
    plane.pulses = [1500] * 6 + [absent] * 12
    assert fly(plane, ages.KILL_SWITCH_S + 0.3) is State.RAMP_OUT


def test_a_flight_state_that_is_no_longer_told_fades_it_out_until_it_is_told_again():
    plane = aircraft()
    plane.flight = IN_AIR
    plane.active()
    plane.flight = None
    assert fly(plane, ages.FLIGHT_STATE_S - 0.25) is State.ACTIVE
    assert fly(plane, 0.3) is State.RAMP_OUT
    assert "DOB RAMP_OUT: flight state no longer told" in texts(plane.said)
    assert fly(plane, 5.0) is State.TRACKING
    plane.flight = IN_AIR
    plane.until(State.ACTIVE)


def test_why_nothing_is_injected_is_said_once_for_each_reason_and_again_after_it_was_injected():
    plane = aircraft().active()
    reasons = []
    for thrust, seconds in ((0.01, 10.0), (0.5, 3.0), (0.02, 10.0)):
        plane.thrust = thrust
        fly(plane, seconds)
        reasons.append([text for text in texts(plane.said) if "throttle" in text])
        plane.said.clear()
    assert reasons == [["DOB RAMP_OUT: throttle below 0.05"], [], ["DOB RAMP_OUT: throttle below 0.05"]]
    plane.armed = False
    fly(plane, 10.0)
    assert [text for text in texts(plane.said) if "armed" in text] == ["DOB TRACKING: not armed"]


def test_what_a_vehicle_said_before_its_clock_restarted_holds_no_more():
    plane = aircraft()
    plane.flight = IN_AIR
    plane.active()
    plane.flight, plane.sample = None, 0
    assert fly(plane, 4.0) is State.TRACKING
    assert plane.companion.status().why == "flight state no longer told"


def test_a_measured_delay_counts_no_more_when_the_vehicle_stops_to_answer():
    plane = aircraft()
    plane.age = float("nan")

    words = []

    def fly_on(seconds, answers):
        for _ in range(round(seconds / DT)):
            plane.pair()
            asked = [m for m in plane.said if m.get_type() == "TIMESYNC"]
            words.extend(texts(plane.said))
            plane.said.clear()
            if answers:
                plane.deliver(*(mav.MAVLink_timesync_message(1, m.ts1) for m in asked))
        return plane.companion.status().state

    fly_on(4.0, answers=True)
    plane.write("DOB_ENABLE", 1.0)
    assert fly_on(3.0, answers=True) is State.ACTIVE
    assert fly_on(ages.ROUND_TRIP_S - 1.0, answers=False) is State.ACTIVE
    assert fly_on(4.0, answers=False) is State.TRACKING
    assert "DOB RAMP_OUT: vehicle reports no delay" in words
    assert plane.companion.status().round_trip_s is None


def asked_for(plane):
    return [m.param1 for m in plane.said if m.get_type() == "COMMAND_LONG"]


@pytest.fixture
def everything():
    """An aircraft in flight that tells all there is, and has been asked for it."""
    plane = with_kill_switch()
    plane.flight, plane.pulses = IN_AIR, HERE
    plane.active()
    plane.said.clear()
    return plane


def test_a_simulation_that_stands_still_makes_nothing_old(everything):
    plane = everything
    pair = plane.imu(), plane.target()
    plane.deliver(*pair)
    for _ in range(300):  # a minute of wall time, the newest pair sent again and again
        plane.now += 0.2
        plane.heartbeat()
        plane.deliver(*pair)
    plane.sample += 1
    plane.pair()
    assert plane.companion.status().state is State.ACTIVE
    assert asked_for(plane) == []


@pytest.mark.parametrize("pace", [0.1, 8.0])
def test_a_simulation_slower_or_faster_than_real_time_makes_nothing_old(everything, pace):
    plane, beat = everything, everything.now
    plane.beats = False
    for _ in range(1500):
        if plane.now >= beat:  # a heart beats by the wall clock
            beat += 1.0
            plane.heartbeat()
        plane.pair()
        plane.now += DT / pace - DT
        assert plane.companion.status().state is State.ACTIVE
    assert asked_for(plane) == []


def test_what_waits_unread_while_this_computer_is_held_up_is_not_old(everything):
    plane = everything
    plane.now = kept = plane.now + 20.0
    for _ in range(1000):  # what was sent meanwhile comes at once
        plane.pair()
        plane.now = kept
    assert not any("not heard" in text or "no longer told" in text for text in texts(plane.said))

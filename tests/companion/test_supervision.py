"""When the companion may inject, and what makes it stop (docs/interfaces.md, What must hold before it injects)."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import Companion, CompanionConfig, parse_config
from dob_companion.supervisor import State
from tests.companion.aircraft import DT, Aircraft, aircraft, corrections, small_design, texts


def enabled(plane, samples=900):
    plane.pairs(600)
    plane.write("DOB_ENABLE", 1.0)
    plane.pairs(samples)
    return plane.companion.status().state


def test_a_vehicle_that_is_not_armed_is_never_corrected_and_disarming_ends_it():
    plane = aircraft()
    plane.armed = False
    assert enabled(plane) is State.TRACKING
    plane.armed = True
    plane.until(State.ACTIVE)
    plane.armed = False
    plane.heartbeat()
    plane.pair()
    assert plane.companion.status().state is State.RAMP_OUT
    assert "DOB RAMP_OUT: not armed" in texts(plane.said)


@pytest.mark.parametrize(("landed", "reached"), [(0, 4), (1, 2), (2, 4), (3, 2), (4, 2)])
def test_only_in_the_air_or_where_the_vehicle_does_not_say(landed, reached):
    plane = aircraft()
    plane.flight = landed, mav.MAV_VTOL_STATE_MC
    assert enabled(plane) == State(reached)


@pytest.mark.parametrize(
    ("status", "landed", "reached"),
    [
        (mav.MAV_STATE_STANDBY, None, State.TRACKING),
        (mav.MAV_STATE_STANDBY, 0, State.TRACKING),
        (mav.MAV_STATE_STANDBY, 2, State.ACTIVE),
        (mav.MAV_STATE_ACTIVE, 1, State.TRACKING),
        (mav.MAV_STATE_UNINIT, None, State.ACTIVE),
        (mav.MAV_STATE_CRITICAL, None, State.ACTIVE),
    ],
)
def test_where_the_vehicle_does_not_say_a_heartbeat_that_stands_by_means_on_the_ground(status, landed, reached):
    plane = aircraft()
    plane.system_status = status
    if landed is not None:
        plane.flight = landed, mav.MAV_VTOL_STATE_MC
    assert enabled(plane) is reached


def test_a_landing_that_only_the_heartbeat_tells_fades_it_out():
    plane = aircraft().active()
    plane.system_status = mav.MAV_STATE_STANDBY
    plane.heartbeat()
    plane.pair()
    assert "DOB RAMP_OUT: standing by, its heartbeat says" in texts(plane.said)


def test_nobody_elses_heartbeat_says_that_we_stand_by():
    plane = aircraft().active()
    gimbal = mav.MAVLink(None, srcSystem=1, srcComponent=154)
    plane.deliver(mav.MAVLink_heartbeat_message(26, 8, 0, 0, mav.MAV_STATE_STANDBY, 3), by=gimbal)
    plane.pairs(2)
    assert plane.companion.status().state is State.ACTIVE


@pytest.mark.parametrize(
    ("vtol", "allowed"),
    [
        (mav.MAV_VTOL_STATE_UNDEFINED, True),
        (mav.MAV_VTOL_STATE_MC, True),
        (mav.MAV_VTOL_STATE_TRANSITION_TO_FW, False),
        (mav.MAV_VTOL_STATE_TRANSITION_TO_MC, False),
        (mav.MAV_VTOL_STATE_FW, False),
    ],
)
def test_transition_and_forward_flight_fade_it_out(vtol, allowed):
    plane = aircraft().active()
    plane.flight = mav.MAV_LANDED_STATE_IN_AIR, vtol
    plane.pairs(60)
    assert (plane.companion.status().state is State.ACTIVE) is allowed


def test_throttle_below_the_floor_fades_it_out():
    plane = aircraft().active()
    plane.thrust = 0.01
    plane.pairs(2)
    assert plane.companion.status().state is State.RAMP_OUT
    assert any("throttle" in text for text in texts(plane.said))


def with_kill_switch():
    config = parse_config("[regime]\nkill_channel = 7\nkill_above = 1700", "c.toml")
    plane = Aircraft(Companion(small_design(), config))
    plane.pulses = [1500] * 18
    return plane


def test_the_kill_switch_of_the_rc_transmitter_fades_it_out_and_lets_it_come_back():
    plane = with_kill_switch().active()
    plane.pulses[6] = 1900
    plane.pairs(51)
    assert plane.companion.status().state is State.RAMP_OUT
    assert any("killed by RC channel 7" in text for text in texts(plane.said))
    plane.pulses[6] = 65535  # a channel that is not there changes nothing
    plane.pairs(300)
    assert plane.companion.status().state is State.TRACKING
    plane.pulses[6] = 1100
    plane.until(State.ACTIVE)


def test_a_second_autopilot_on_the_link_ends_it():
    plane = aircraft().active()
    plane.deliver(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3), by=mav.MAVLink(None, 9, 1))
    plane.pair()
    assert plane.companion.status().state is State.RAMP_OUT
    assert any("another controller on the link: 9/1" in text for text in texts(plane.said))


def test_a_second_companion_that_injects_ends_it_but_our_own_echo_does_not():
    plane = aircraft().active()
    (mine,) = plane.pair()
    echo = mav.MAVLink_debug_vect_message(b"DOB_CORR", mine.time_usec, mine.x, mine.y, mine.z)
    plane.deliver(echo)
    plane.deliver(echo, by=mav.MAVLink(None, 1, 191))
    plane.pair()
    assert plane.companion.status().state is State.ACTIVE
    other = mav.MAVLink_debug_vect_message(b"DOB_CORR", mine.time_usec, 0.1, 0.0, 0.0)
    plane.deliver(other, by=mav.MAVLink(None, 1, 192))
    plane.pair()
    assert plane.companion.status().state is State.RAMP_OUT


@pytest.mark.parametrize("contained", [-0.15, 0.05])
def test_corrections_that_come_back_larger_or_with_another_sign_latch_a_fault(contained):
    plane = aircraft().active()
    plane.rates = (0.1, 0.0, 0.0)
    plane.pairs(50)
    for _ in range(10):
        plane.contained = (contained, 0.0, 0.0)
        plane.pair()
    plane.pairs(300)
    assert plane.companion.status().state is State.FAULT


@pytest.mark.parametrize("contained", [-0.05, 0.0])
def test_a_vehicle_may_take_a_part_of_a_correction_or_nothing(contained):
    plane = aircraft().active()
    plane.rates = (0.1, 0.0, 0.0)
    plane.pairs(50)
    plane.contained = (contained, 0.0, 0.0)
    plane.pairs(300)
    assert plane.companion.status().state is State.ACTIVE


def test_no_heartbeat_of_the_autopilot_for_five_seconds_fades_it_out():
    plane = aircraft().active()
    plane.beats = False
    plane.pairs(1000)
    assert plane.companion.status().state is State.ACTIVE
    plane.pairs(700)
    assert plane.companion.status().state is not State.ACTIVE
    assert any("no heartbeat" in text for text in texts(plane.said))


def test_an_estimate_that_jumps_is_a_fault_and_fades_what_was_sent():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    plane.rates = (10.0, 0.0, 0.0)
    faded = [c.x for c in plane.pairs(130)]
    assert min(faded) >= -0.2 - 1e-6
    assert np.all(np.diff(faded[2:]) >= -1e-9)
    assert plane.companion.status().state is State.FAULT


def test_a_moment_at_its_stops_leaves_nothing_to_correct_with():
    plane = aircraft().active()
    plane.moment = (1.0, 0.0, 0.0)
    plane.pairs(200)
    assert plane.companion.status().state is not State.ACTIVE
    assert any("at its stops" in text for text in texts(plane.said))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda y, u: (y * [1, -1, 1], u), "pitch is inverted"),
        (lambda y, u: (y, u * [1, 1, -1]), "yaw is inverted"),
        (lambda y, u: (y[[1, 0, 2]], u), "roll is swapped with pitch"),
        (lambda y, u: (y * [1, 1, 57.3], u), "yaw is scaled by"),
    ],
)
def test_an_inverted_swapped_or_badly_scaled_axis_refuses_to_enable_and_is_named(spoil, words):
    plane = aircraft(CompanionConfig())
    plane.heartbeat()
    rng = np.random.default_rng(5)

    def fly(samples):
        y = np.zeros(3)
        for _ in range(samples):
            y = 0.8 * y + rng.normal(0, 0.01, 3)
            rates, moment = spoil(y, -0.1 * y)  # the small design's controller is C = 0.1
            plane.rates, plane.moment = tuple(rates), tuple(moment)
            plane.pair()

    fly(900)
    plane.write("DOB_ENABLE", 1.0)
    fly(300)
    assert plane.companion.status().state is State.TRACKING
    assert all((c.x, c.y, c.z) == (0, 0, 0) for c in corrections(plane.said))
    plane.write("DOB_AXES", 7.0)
    assert words in plane.companion.status().why


def test_right_axes_are_enabled():
    plane = aircraft()
    plane.heartbeat()
    rng = np.random.default_rng(5)
    y = np.zeros(3)
    for k in range(1200):
        y = 0.8 * y + rng.normal(0, 0.01, 3)
        plane.rates, plane.moment = tuple(y), tuple(-0.1 * y)
        plane.pair()
        if k == 700:
            plane.write("DOB_ENABLE", 1.0)
    assert plane.companion.status().state is State.ACTIVE


def test_the_round_trip_is_measured_and_stands_in_for_an_age_that_the_vehicle_does_not_report():
    plane = aircraft()
    plane.age = float("nan")
    plane.heartbeat()

    def fly(samples, later):
        for _ in range(samples):
            plane.pair()
            for asked in [m for m in plane.said if m.get_type() == "TIMESYNC" and m.tc1 == 0]:
                plane.said.remove(asked)
                plane.now += later
                plane.deliver(mav.MAVLink_timesync_message(1, asked.ts1))

    fly(900, 0.001)
    assert plane.companion.status().round_trip_s == pytest.approx(0.005, abs=1e-6)
    assert plane.companion.status().delay_samples == 2
    plane.write("DOB_ENABLE", 1.0)
    plane.until(State.ACTIVE)
    fly(1500, 0.03)
    assert plane.companion.status().delay_samples == 9
    assert plane.companion.status().state is not State.ACTIVE


@pytest.mark.parametrize(("shift", "words"), [(5_000_000, "+5.0 s"), (-5_000_000, "-5.0 s"), (100_000, "+0.100 s")])
def test_moments_stamped_by_another_clock_are_named_never_injected_with_and_forgotten_on_one_clock(shift, words):
    plane = aircraft()

    def fly(samples, shift):
        for _ in range(samples):
            if plane.sample % 250 == 0:
                plane.heartbeat()
            plane.deliver(plane.imu(), plane.target(stamp=plane.stamp + shift))
            plane.sample, plane.now = plane.sample + 1, plane.now + DT

    plane.heartbeat()
    plane.write("DOB_ENABLE", 1.0)
    fly(1500, shift)
    assert plane.companion.status().why == f"moments are stamped by another clock than the gyro: {words}"
    assert f"DOB: gyro and moments on two clocks: {words}" in texts(plane.said)
    assert not any(c.x or c.y or c.z for c in corrections(plane.said))
    assert len(plane.companion.loop.samples._moments) <= 64
    fly(1500, 0)
    assert "DOB: gyro and moments on one clock" in texts(plane.said)
    assert plane.companion.status().state is State.ACTIVE

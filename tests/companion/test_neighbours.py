"""Who else is on the link: trouble while it lasts, and never ourselves."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import Companion, CompanionConfig
from dob_companion.supervisor import State, ages
from tests.companion.aircraft import DT, Aircraft, aircraft, corrections, small_design, texts

TROUBLE = "another controller"


def fly(plane, seconds):
    plane.pairs(round(seconds / DT))
    return plane.companion.status().state


def autopilot(system):
    return mav.MAVLink(None, system, 1)


def beat(plane, system):
    plane.deliver(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3), by=autopilot(system))


def test_one_heartbeat_of_another_autopilot_is_trouble_for_five_seconds_and_both_ends_are_said():
    plane = aircraft().active()
    beat(plane, 2)
    assert fly(plane, ages.STRANGER_S - 0.1) is State.TRACKING
    plane.until(State.ACTIVE)
    said = texts(plane.said)
    begin, end = said.index("DOB: another controller on the link: 2/1"), said.index("DOB: 2/1 gone, not heard for 5 s")
    assert begin < end < max(k for k, text in enumerate(said) if text.startswith("DOB ACTIVE"))
    assert plane.companion.status().why == ""


def test_another_autopilot_that_goes_on_stays_trouble_and_is_said_once():
    plane = aircraft().active()
    for _ in range(12):
        beat(plane, 2)
        assert fly(plane, 1.0) is not State.ACTIVE
    assert texts(plane.said).count("DOB: another controller on the link: 2/1") == 1


def test_many_others_do_not_fill_the_memory_nor_the_link_with_words():
    plane = aircraft().active()
    plane.said.clear()
    for system in range(2, 200):
        beat(plane, system)
    assert len([text for text in texts(plane.said) if TROUBLE in text]) < 10
    assert fly(plane, ages.STRANGER_S + 2.0) is State.ACTIVE


def with_interruption(plane):
    """1.2 s of nothing in which the fade goes on without samples; the vehicle's clock goes on."""
    end = plane.now + 1.2
    while plane.now < end:
        plane.now = min(plane.companion.next_deadline(), end)
        plane.listen()
    plane.sample += 300


def with_a_burst_that_was_late(plane):
    """The samples of 0.6 s come after the fade has begun without them, and are answered after all."""
    end = plane.now + 0.6
    while plane.now < end:
        plane.now = min(plane.companion.next_deadline(), end)
        plane.listen()
    for _ in range(150):
        plane.deliver(plane.imu(), plane.target())
        plane.sample += 1


def with_a_restart(plane):
    plane.sample -= 500


def with_a_gap(plane):
    plane.sample += 7


def with_a_broken_gyro(plane):
    plane.deliver(plane.imu(rates=(float("nan"), 0.0, 0.0)))
    plane.sample += 1


MISHAPS = (with_interruption, with_a_burst_that_was_late, with_a_restart, with_a_gap, with_a_broken_gyro)


@pytest.mark.parametrize(
    ("late", "carrier"),
    [
        (0, "DEBUG_VECT"),
        (300, "SET_ACTUATOR_CONTROL_TARGET"),
        *(pytest.param(late, "DEBUG_VECT", marks=pytest.mark.proof) for late in (65, 129, 300, 700)),
    ],
)
def test_a_link_that_sends_back_all_that_we_say_is_never_another_controller(late, carrier):
    plane = Aircraft(Companion(small_design(), CompanionConfig(correction_message=carrier))).active()
    rng, reflected = np.random.default_rng(late), 0
    companion = mav.MAVLink(None, 1, 191)
    plane.said.clear()
    for k in range(250 * (len(MISHAPS) + 1)):
        plane.rates = tuple(rng.normal(0.0, 0.02, 3).tolist())
        if k and k % 250 == 0:
            MISHAPS[k // 250 - 1](plane)
        plane.pair()
        due = plane.said[reflected : max(reflected, len(plane.said) - late)]
        reflected += len(due)
        for message in due:
            plane.deliver(message, by=companion)
    assert reflected > 500
    assert not [text for text in texts(plane.said) if TROUBLE in text]


def twin_that_injects(plane, value):
    """A second companion with our ids that answers the newest sample."""
    message = mav.MAVLink_debug_vect_message(b"DOB_CORR", plane.stamp - 4000, *value)
    plane.deliver(message, by=mav.MAVLink(None, 1, 191))


def test_a_second_companion_with_our_very_ids_is_found_by_what_it_says():
    plane = aircraft().active()
    plane.rates = (0.1, 0.0, 0.0)
    plane.pairs(50)
    twin_that_injects(plane, (0.05, 0.0, 0.0))
    plane.pair()
    assert "DOB: another controller on the link: 1/191" in texts(plane.said)
    assert plane.companion.status().state is State.RAMP_OUT
    assert fly(plane, ages.STRANGER_S + 1.0) is State.ACTIVE


def test_a_second_companion_that_answers_samples_that_we_have_not_heard_is_found():
    plane = aircraft().active()
    plane.sample += 1  # bridged
    plane.pairs(2)
    lost = mav.MAVLink_debug_vect_message(b"DOB_CORR", plane.stamp - 3 * 4000, 0.0, 0.0, 0.0)
    assert plane.companion.status().state is State.ACTIVE
    plane.deliver(lost, by=mav.MAVLink(None, 1, 191))
    plane.pair()
    assert plane.companion.status().state is State.RAMP_OUT


def test_an_autopilot_that_sends_corrections_on_under_its_own_name_is_not_another():
    plane = aircraft().active()
    for _ in range(300):
        for heard in plane.pair():
            plane.deliver(heard)
    assert plane.companion.status().state is State.ACTIVE


# The vehicle comes back as another ---------------------------------------------------------------------------------


def returned_as(plane, system):
    """The vehicle restarts under another id."""
    plane.out = autopilot(system)
    plane.sample = 0


def test_a_vehicle_that_returns_with_a_new_system_id_is_obeyed_when_the_old_one_has_been_silent_and_it_is_off():
    plane = aircraft()
    plane.flight = mav.MAV_LANDED_STATE_IN_AIR, mav.MAV_VTOL_STATE_MC
    plane.active()
    plane.write("DOB_GAIN", 0.5)
    returned_as(plane, 7)
    fly(plane, ages.VEHICLE_S - 1.0)
    assert plane.companion.vehicle == 1
    assert "DOB: another controller on the link: 7/1" in texts(plane.said)
    assert not any(m.x or m.y or m.z for m in corrections(plane.said[-500:]))
    plane.said.clear()
    fly(plane, 2.0)
    assert plane.companion.vehicle == 7
    assert "DOB: system 1 silent for 10 s, obey 7" in texts(plane.said)
    values = {m.param_id: m.param_value for m in plane.said if m.get_type() == "PARAM_VALUE"}
    assert values["DOB_ENABLE"] == 0.0
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in plane.said[-50:]} == {(7, 191)}
    asked = [m for m in plane.said if m.get_type() == "COMMAND_LONG" and m.get_srcSystem() == 7]
    assert {m.target_system for m in asked} == {7}
    assert fly(plane, 5.0) is State.DISABLED
    assert plane.companion.status().why == ""
    plane.write("DOB_ENABLE", 1.0, system=7)
    plane.until(State.ACTIVE)
    assert plane.companion.parameters["DOB_GAIN"] == 0.5


def test_everything_is_measured_anew_for_a_vehicle_that_takes_the_place_of_another():
    plane = aircraft()
    plane.flight = mav.MAV_LANDED_STATE_IN_AIR, mav.MAV_VTOL_STATE_MC
    plane.active()
    returned_as(plane, 7)
    plane.flight, plane.armed = None, False
    fly(plane, ages.VEHICLE_S + 2.0)
    plane.write("DOB_ENABLE", 1.0, system=7)
    fly(plane, 4.0)
    assert plane.companion.status().why == "not armed"
    status = plane.companion.status()
    assert status.stepped < 250 * 6
    plane.armed = True
    plane.until(State.ACTIVE)  # it has never told a flight state, whatever the other had


def test_what_we_said_to_the_old_vehicle_and_comes_back_late_is_still_ours():
    plane = aircraft().active()
    old = corrections(plane.said)[-100:]
    returned_as(plane, 7)
    fly(plane, ages.VEHICLE_S + 2.0)
    assert plane.companion.vehicle == 7
    plane.said.clear()
    for message in old:
        plane.deliver(message, by=mav.MAVLink(None, 1, 191))
        plane.pair()
    assert not [text for text in texts(plane.said) if TROUBLE in text]


def test_the_old_vehicle_that_comes_back_after_all_is_trouble():
    plane = aircraft().active()
    returned_as(plane, 7)
    fly(plane, ages.VEHICLE_S + 2.0)
    beat(plane, 1)
    assert "DOB: another controller on the link: 1/1" in texts(plane.said)


def test_a_vehicle_that_still_sends_samples_is_not_given_up_for_another():
    plane = aircraft().active()
    plane.beats = False
    for _ in range(15):
        beat(plane, 7)
        fly(plane, 1.0)
    assert plane.companion.vehicle == 1


def test_a_configured_vehicle_is_the_only_one_that_is_obeyed_and_the_other_is_named():
    plane = Aircraft(Companion(small_design(), CompanionConfig(system=3)))
    fly(plane, 20.0)
    assert plane.companion.vehicle is None
    assert "DOB: another controller on the link: 1/1" in [event.text for event in plane.companion.events()]

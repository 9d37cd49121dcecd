"""The excitation on the wire: who is answered, in which message, and what a ground station sees and may do."""

import math

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import CompanionConfig
from dob_companion.excitation.exciter import Exciter
from dob_companion.supervisor import RegimeLimits, State
from tests.companion.aircraft import DT, Aircraft, texts
from tests.excitation.hover import SHORT, plan

IN_AIR = (mav.MAV_LANDED_STATE_IN_AIR, mav.MAV_VTOL_STATE_MC)


class Watched(Aircraft):
    """Tells attitude, altitude and battery as well."""

    tilt, altitude, percent = 0.02, 5.0, 80

    def slow(self):
        yield from super().slow()
        ms = self.stamp // 1000
        yield mav.MAVLink_attitude_message(ms, self.tilt, 0.0, 1.0, 0, 0, 0)
        yield mav.MAVLink_global_position_int_message(ms, 0, 0, 0, round(1e3 * self.altitude), 0, 0, 0, 0)
        yield mav.MAVLink_sys_status_message(0, 0, 0, 0, 12000, -1, self.percent, 0, 0, 0, 0, 0, 0)


def excited(config=None, autopilot=mav.MAV_AUTOPILOT_GENERIC, **more):
    """An aircraft that is excited about pitch."""
    exciter = Exciter(plan(), config or CompanionConfig(regime=RegimeLimits(kill_channel=7)), **more)
    plane = Watched(exciter, autopilot, flight=IN_AIR, pulses=[1500] * 6 + [1000] * 12)
    plane.heartbeat()
    return plane


def ended(plane, most=2500):
    for _ in range(most):
        if plane.companion.closed:
            return plane.companion.excitation.outcome
        plane.pair()
    raise AssertionError(f"not closed: {plane.companion.excitation.why}")


def said(plane, name):
    return [m for m in plane.said if m.get_type() == name]


@pytest.mark.parametrize(
    ("autopilot", "carrier"),
    [
        (mav.MAV_AUTOPILOT_GENERIC, "DEBUG_VECT"),
        (mav.MAV_AUTOPILOT_ARDUPILOTMEGA, "DEBUG_VECT"),
        (mav.MAV_AUTOPILOT_PX4, "TUNNEL"),
    ],
)
def test_it_speaks_as_the_companion_in_the_message_of_the_profile_and_asks_for_what_limits(autopilot, carrier):
    plane = excited(autopilot=autopilot)
    assert ended(plane) == "complete"
    sent = said(plane, carrier)
    assert len(sent) >= plane.sample
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in plane.said} == {(1, 191)}
    asked = {int(m.param1) for m in said(plane, "COMMAND_LONG") if m.command == mav.MAV_CMD_SET_MESSAGE_INTERVAL}
    assert mav.MAVLINK_MSG_ID_ATTITUDE in asked  # which comes at 5 Hz only
    assert len(said(plane, "HEARTBEAT")) >= plane.now - 1


def test_a_ground_station_sees_what_is_done():
    plane = excited()
    ended(plane)
    words = texts(plane.said)
    assert any("excites pitch" in text for text in words)
    for text in ("DOB RAMP_IN: pitch begins", "DOB ACTIVE: faded in", "DOB RAMP_OUT: pitch is done"):
        assert text in words
    assert words[-1] == "DOB DISABLED: complete"
    states = {round(m.data[6]) for m in said(plane, "DEBUG_FLOAT_ARRAY") if m.name == "DOB"}
    assert {State.TRACKING, State.RAMP_IN, State.ACTIVE, State.RAMP_OUT} <= states


def test_dob_enable_is_on_and_its_off_ends_it():
    plane = excited()
    plane.until(State.ACTIVE)
    heard = plane.deliver(mav.MAVLink_param_request_read_message(1, 191, b"DOB_ENABLE", -1), by=plane.ground)
    assert [m.param_value for m in heard if m.get_type() == "PARAM_VALUE"] == [1.0]
    plane.write("DOB_ENABLE", 0.0)
    assert ended(plane, 400) == "aborted: switched off"


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"tilt": math.radians(30.0)}, "tilt 30 deg beyond 25"),
        ({"altitude": 1.0}, "altitude changed by -4.0 m"),
        ({"percent": 10}, "battery 10 % below 20 %"),
        ({"pulses": [1500] * 6 + [1900] * 12}, "killed by RC channel 7"),
        ({"system_status": mav.MAV_STATE_CRITICAL}, "autopilot reports a failsafe"),
    ],
)
def test_what_the_vehicle_tells_limits_it(change, reason):
    plane = excited()
    plane.until(State.ACTIVE)
    for name, value in change.items():
        setattr(plane, name, value)
    assert ended(plane, 600) == f"aborted: {reason}"


def test_a_battery_that_is_not_known_limits_nothing_and_is_named():
    plane = excited()
    plane.percent = -1
    assert ended(plane) == "complete"
    assert any(e.text == "not told by the vehicle, so no limit: battery" for e in plane.companion.events())


def test_another_companions_correction_under_our_own_name_ends_it():
    plane = excited()
    plane.until(State.ACTIVE)
    other = mav.MAVLink(None, srcSystem=1, srcComponent=191)
    for _ in range(3):
        plane.deliver(mav.MAVLink_debug_vect_message(b"DOB_CORR", plane.stamp - 4000, 0.3, 0.0, 0.0), by=other)
        plane.pair()
    assert ended(plane, 200) == "aborted: another controller on the link: 1/191"


def test_a_link_that_sends_our_own_words_back_does_not():
    plane = excited()
    plane.until(State.ACTIVE)
    for _ in range(50):
        for message in list(plane.said[-3:]):
            plane.companion.receive(bytes(message.get_msgbuf()), plane.now)
        plane.pair()
    assert plane.companion.excitation.outcome == ""


def test_silence_is_followed_by_zeros_and_the_end():
    plane = excited()
    plane.until(State.ACTIVE)
    before = len(plane.said)
    for _ in range(300):
        plane.now += DT
        plane.listen()
    last = [m for m in plane.said[before:] if m.get_type() == "DEBUG_VECT"]
    assert last
    assert not any(m.x or m.y or m.z for m in last)
    assert plane.companion.excitation.outcome == "aborted: no samples"
    assert plane.companion.closed


def test_leaving_fades_and_says_that_it_was_stopped():
    plane = excited()
    plane.until(State.ACTIVE)
    plane.companion.close(plane.now)
    assert ended(plane, 200) == "aborted: stopped"
    last = said(plane, "DEBUG_VECT")[-1]
    assert (last.x, last.y, last.z) == (0.0, 0.0, 0.0)


def test_what_does_not_begin_in_time_ends_with_what_it_waited_for():
    plane = excited(begin_by=4.0)
    plane.armed = False
    assert ended(plane, 1100) == "aborted: not begun in time: not armed"


def test_a_record_that_cannot_be_kept_ends_it():
    trouble = [""]
    plane = excited(trouble=lambda: trouble[0])
    plane.until(State.ACTIVE)
    trouble[0] = "excite.tlog: cannot be written: No space left on device"
    assert ended(plane, 400) == f"aborted: {trouble[0]}"


def test_start_values_of_the_configuration_are_for_run():
    exciter = Exciter(plan(pitch=0.04, yaw=0.1), CompanionConfig(parameters={"DOB_LIMIT": 0.01, "DOB_GAIN": 0.5}))
    assert exciter.parameters["DOB_LIMIT"] == 0.1
    assert exciter.parameters["DOB_GAIN"] == 1.0
    assert SHORT.seconds == 4.0

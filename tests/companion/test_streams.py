"""Each stream is asked for until it is heard at its rate, and again when it goes missing."""

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import Companion, parse_config
from dob_companion.supervisor import State
from tests.companion.aircraft import DT, Aircraft, small_design, texts

GYRO, MOMENT = mav.MAVLINK_MSG_ID_HIGHRES_IMU, mav.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET
FLIGHT, RC = mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, mav.MAVLINK_MSG_ID_RC_CHANNELS
SET_INTERVAL = mav.MAV_CMD_SET_MESSAGE_INTERVAL


class Autopilot(Aircraft):
    """Sends what it was asked for and no more, and acknowledges in the ways that autopilots and links have."""

    def __init__(self, acks=1, results=(), stopped=(), **more):
        super().__init__(Companion(small_design(), parse_config("[regime]\nkill_channel = 7", "c.toml")), **more)
        self.acks, self.results, self.stopped = acks, dict(results), set(stopped)
        self.on, self.asked = set(), []

    def sends(self, message):
        return message in self.on and message not in self.stopped

    def listen(self):
        heard = super().listen()
        for command in [m for m in heard if m.get_type() == "COMMAND_LONG"]:
            message = int(command.param1)
            self.asked.append((round(self.now, 3), message))
            result = self.results.get(message, mav.MAV_RESULT_ACCEPTED)
            if result != mav.MAV_RESULT_DENIED:
                self.on.add(message)
            ack = mav.MAVLink_command_ack_message(SET_INTERVAL, result, 0, 0, 1, 191)
            for _ in range(self.acks):
                self.deliver(ack)
        return heard

    def step(self, *, moment=True):
        self.flight = (mav.MAV_LANDED_STATE_IN_AIR, mav.MAV_VTOL_STATE_MC) if self.sends(FLIGHT) else None
        self.pulses = [1500] * 18 if self.sends(RC) else None
        if self.sample % 250 == 0:
            self.heartbeat()
        if self.sample % 50 == 0:
            self.deliver(*self.slow())
        pair = [(GYRO, self.imu()), *([(MOMENT, self.target())] if moment else [])]
        self.deliver(*(m for number, m in pair if self.sends(number)))
        self.sample += 1
        self.now += DT

    def fly(self, seconds):
        for _ in range(round(seconds / DT)):
            self.step()
        return self.companion.status().state

    def since(self, moment):
        return [message for when, message in self.asked if when >= moment]


@pytest.mark.parametrize("acks", [0, 2])
def test_every_stream_is_asked_for_however_often_a_request_is_acknowledged(acks):
    plane = Autopilot(acks)
    plane.fly(6.0)
    assert [message for _, message in plane.asked[:4]] == [GYRO, MOMENT, FLIGHT, RC]
    plane.write("DOB_ENABLE", 1.0)
    assert plane.fly(3.0) is State.ACTIVE
    quiet = plane.now
    assert plane.fly(8.0) is State.ACTIVE
    assert plane.since(quiet) == []  # heard at its rate, a stream is not asked for


def test_acknowledgements_that_come_apart_do_not_settle_the_next_request():
    plane = Autopilot(acks=0)
    for _ in range(400):
        before = len(plane.asked)
        plane.step()
        if len(plane.asked) > before:  # a copy by a slower link every 20 ms
            for _ in range(3):
                plane.deliver(mav.MAVLink_command_ack_message(SET_INTERVAL, 0, 0, 0, 1, 191))
                plane.now += 0.02
    assert plane.on == {GYRO, MOMENT, FLIGHT, RC}


def test_an_acknowledgement_of_nothing_that_was_asked_settles_nothing():
    plane = Autopilot(acks=0)
    plane.heartbeat()
    for target in ((1, 191), (0, 0), (255, 190), (255, 191), (9, 191)):
        plane.deliver(mav.MAVLink_command_ack_message(SET_INTERVAL, 2, 0, 0, *target))
        plane.now += 0.3
    refused = [text for text in texts(plane.said) if "refused" in text]
    assert refused == ["DOB: HIGHRES_IMU refused (2)"]  # the first; the others find no request open, or are not for us
    plane.fly(6.0)
    assert plane.on == {GYRO, MOMENT, FLIGHT, RC}


def test_a_request_that_is_in_progress_is_not_refused():
    plane = Autopilot(results={MOMENT: mav.MAV_RESULT_IN_PROGRESS})
    plane.fly(8.0)
    assert not any("refused" in text for text in texts(plane.said))
    assert plane.on == {GYRO, MOMENT, FLIGHT, RC}


def test_a_refusal_is_said_once_and_asked_about_again_every_five_seconds():
    plane = Autopilot(results={FLIGHT: mav.MAV_RESULT_DENIED})
    plane.fly(16.0)
    assert [text for text in texts(plane.said) if "EXTENDED_SYS_STATE" in text] == [
        "DOB: EXTENDED_SYS_STATE refused (2)"
    ]
    assert 3 <= plane.since(0.0).count(FLIGHT) <= 4
    assert plane.since(1.0) == [FLIGHT] * (plane.since(0.0).count(FLIGHT) - 1)


def test_a_moment_that_comes_unasked_at_a_rate_of_its_own_is_not_asked_for_and_missed_only_when_none_comes():
    """ArduPilot refuses ACTUATOR_CONTROL_TARGET, which the script sends."""
    plane = Autopilot(results={MOMENT: mav.MAV_RESULT_DENIED}, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA)
    plane.on.add(MOMENT)
    plane.fly(4.0)
    for k in range(1500):
        plane.step(moment=k % 3 > 0)  # two thirds of the rate
    assert MOMENT not in plane.since(0.0)
    assert not any("ACTUATOR_CONTROL_TARGET" in text for text in texts(plane.said))
    plane.stopped.add(MOMENT)
    plane.fly(12.0)
    assert MOMENT not in plane.since(0.0)
    assert texts(plane.said).count("DOB: ACTUATOR_CONTROL_TARGET lacking") == 1


@pytest.mark.parametrize(
    ("number", "name"),
    [
        (GYRO, "HIGHRES_IMU"),
        (FLIGHT, "EXTENDED_SYS_STATE"),
        pytest.param(MOMENT, "ACTUATOR_CONTROL_TARGET", marks=pytest.mark.proof),
        pytest.param(RC, "RC_CHANNELS", marks=pytest.mark.proof),
    ],
)
def test_exactly_the_stream_that_has_stopped_is_asked_for_again_within_five_seconds(number, name):
    plane = Autopilot()
    plane.fly(7.3)
    plane.stopped.add(number)
    stopped = plane.now
    plane.fly(5.0)
    again = plane.since(stopped)
    assert again
    assert set(again) == {number}
    assert f"DOB: {name} lacking, asked again" in texts(plane.said)
    plane.fly(7.0)
    assert 2 <= plane.since(stopped).count(number) <= 3
    assert texts(plane.said).count(f"DOB: {name} lacking, asked again") == 1
    assert set(plane.since(stopped)) == {number}
    plane.stopped.clear()
    plane.fly(3.0)
    heard = plane.now
    plane.fly(7.0)
    assert plane.since(heard) == []


def test_an_autopilot_that_restarts_and_has_forgotten_is_asked_for_everything():
    plane = Autopilot()
    plane.fly(8.0)
    plane.on.clear()
    plane.sample, restarted = 0, plane.now
    plane.fly(8.0)
    assert set(plane.since(restarted)) == {GYRO, MOMENT, FLIGHT, RC}
    assert plane.on == {GYRO, MOMENT, FLIGHT, RC}


def test_a_stream_at_half_its_rate_is_asked_for_again_even_when_each_message_comes_twice():
    plane = Autopilot()
    plane.fly(8.0)
    slow = plane.now
    for k in range(1500):
        if k % 2 == 0:
            plane.deliver(plane.target())
        plane.step(moment=k % 2 == 0)
    assert set(plane.since(slow)) == {MOMENT}

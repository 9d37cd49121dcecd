"""What passes between the companion and the ground station, and what does not."""

import math

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl.autopilot.vehicle import START_US
from sitl.wire.endpoint import COMPANION, GROUND
from tests.sitl.bench import command
from tests.sitl.wire import STATION, Wire, kinds

NAN = math.nan


@pytest.fixture
def wire() -> Wire:
    return Wire()


def to_station(message) -> bool:
    wire = Wire()
    wire.meet()
    wire.say(COMPANION, message)
    return message.get_type() in kinds(wire.take(GROUND))


def to_companion(message) -> bool:
    wire = Wire()
    wire.meet()
    wire.say(GROUND, message)
    return message.get_type() in kinds(wire.take(COMPANION))


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3),
        mavlink.MAVLink_statustext_message(4, b"hello"),
        mavlink.MAVLink_param_value_message(b"DOB_GAIN", 1.0, 9, 6, 2),
        mavlink.MAVLink_param_error_message(255, 190, b"DOB_X", -1, 1),
        mavlink.MAVLink_param_error_message(7, 7, b"DOB_X", -1, 1),
        mavlink.MAVLink_debug_float_array_message(1, b"DOB", 0, [0.0] * 58),
        mavlink.MAVLink_command_ack_message(400, 0, 0, 0, 255, 190),
        mavlink.MAVLink_command_ack_message(400, 0, 0, 0, 0, 0),
        mavlink.MAVLink_command_ack_message(400, 0, 0, 0, 255, 0),
    ],
    ids=str,
)
def test_the_companion_is_heard_at_the_ground_station(message):
    assert to_station(message)


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_debug_vect_message(b"DOB_CORR", START_US, 0.0, 0.0, 0.0),
        mavlink.MAVLink_debug_vect_message(b"OTHER", START_US, 0.0, 0.0, 0.0),
        mavlink.MAVLink_set_actuator_control_target_message(START_US, 2, 0, 0, [0.0] * 8),
        mavlink.MAVLink_timesync_message(5, 5),
        mavlink.MAVLink_attitude_message(1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        mavlink.MAVLink_command_ack_message(400, 0, 0, 0, 255, 7),
        mavlink.MAVLink_command_ack_message(400, 0, 0, 0, 9, 0),
    ],
    ids=str,
)
def test_what_is_not_for_the_ground_station_does_not_reach_it(message):
    assert not to_station(message)


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9),
        mavlink.MAVLink_param_set_message(1, 0, b"DOB_ENABLE", 1.0, 9),
        mavlink.MAVLink_param_request_list_message(1, 0),
        mavlink.MAVLink_param_request_list_message(0, 0),
        command(512, 148.0, target=(1, 191)),
        mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
    ],
    ids=str,
)
def test_the_ground_station_reaches_the_companion(message):
    assert to_companion(message)


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_param_set_message(1, 1, b"SIM_ATT_P", 6.0, 9),
        mavlink.MAVLink_param_set_message(1, 192, b"DOB_ENABLE", 1.0, 9),
        mavlink.MAVLink_param_set_message(2, 191, b"DOB_ENABLE", 1.0, 9),
        mavlink.MAVLink_timesync_message(0, 5),
        command(512, 148.0),
    ],
    ids=str,
)
def test_what_is_not_for_the_companion_does_not_reach_it(message):
    assert not to_companion(message)


def test_a_forwarded_message_is_not_altered_by_a_byte(wire):
    wire.meet()
    message = mavlink.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9)
    raw = message.pack(mavlink.MAVLink(None, *STATION))
    wire.endpoint.receive(GROUND, raw)
    assert wire.endpoint.bytes_to_send(COMPANION) == [raw]


def test_the_companion_s_parameters_are_out_of_reach_before_it_was_heard(wire):
    wire.say(GROUND, mavlink.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9))
    assert wire.take(COMPANION) == []


def test_an_echo_of_the_vehicle_itself_is_ignored(wire):
    wire.say(GROUND, mavlink.MAVLink_heartbeat_message(20, 0, 0, 0, 4, 3), source=(1, 1))
    assert wire.take(COMPANION) == []

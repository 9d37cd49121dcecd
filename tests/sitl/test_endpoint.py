"""Heartbeats, clock exchange, notices and garbage on the vehicle's links."""

import math
import random

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl.wire.endpoint import COMPANION, GROUND
from tests.sitl.bench import command, parser_of
from tests.sitl.wire import ACCEPTED, OBSERVER, STATION, Wire, kinds

NAN = math.nan


@pytest.fixture
def wire() -> Wire:
    return Wire()


@pytest.mark.parametrize("link", [COMPANION, GROUND])
def test_timesync_is_answered_in_vehicle_time_on_the_link_it_came_from(wire, link):
    wire.meet()
    wire.say(link, mavlink.MAVLink_timesync_message(0, 123456789))
    (answer,) = wire.take(link)
    assert (answer.tc1, answer.ts1) == (wire.flight.vehicle.now_us * 1000, 123456789)
    assert wire.take(GROUND if link == COMPANION else COMPANION) == []


def test_heartbeats_go_out_once_a_second_of_wall_time_while_the_clock_stands(wire):
    wire.take(GROUND)
    for i in range(1000):
        wire.endpoint.advance(i * 0.01)
    for link in (COMPANION, GROUND):
        assert kinds(wire.take(link)).count("HEARTBEAT") == 10


def test_the_heartbeat_says_armed(wire):
    def armed() -> bool:
        (beat,) = wire.ask(command(mavlink.MAV_CMD_REQUEST_MESSAGE, 0.0))[:1]
        return bool(beat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)

    assert not armed()
    wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    assert armed()


def test_what_is_waited_for_is_said_at_once_and_every_second(wire):
    def texts(start: float) -> list[str]:
        for i in range(301):
            wire.endpoint.advance(start + i * 0.01)
        return [m.text for m in wire.take(GROUND) if m.get_type() == "STATUSTEXT"]

    assert texts(0.0) == ["sitl: waiting for arm"] * 4
    wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    assert texts(3.0)[0] == "sitl: waiting for takeoff"


def test_garbage_is_counted_and_what_follows_it_is_understood(wire):
    noise = random.Random(1)
    for _ in range(300):
        wire.endpoint.receive(GROUND, noise.randbytes(noise.randrange(1, 300)))
        wire.endpoint.receive(COMPANION, noise.randbytes(noise.randrange(1, 300)))
    assert wire.endpoint.bad > 100
    for _ in range(20):  # random bytes may have announced a long message that never comes
        wire.endpoint.receive(GROUND, bytes(300))
    wire.take(GROUND)
    assert wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == ACCEPTED


def test_a_damaged_message_is_never_taken_for_a_whole_one():
    wire, noise = Wire(), random.Random(2)
    wire.take_off()
    for _ in range(500):
        stamp = wire.flight.vehicle.now_us
        raw = bytearray(
            mavlink.MAVLink_debug_vect_message(b"DOB_CORR", stamp, 0.5, 0.5, 0.5).pack(mavlink.MAVLink(None, *OBSERVER))
        )
        raw[noise.randrange(1, len(raw))] ^= 1 << noise.randrange(8)
        wire.endpoint.receive(COMPANION, bytes(raw) + bytes(300))
        wire.step()
        assert not any(wire.flight.newest.correction)


def test_messages_of_an_unknown_kind_are_passed_over(wire):
    wire.meet()
    header = bytes([0xFD, 3, 0, 0, 7, 255, 190, 0xF0, 0xFF, 0x77])
    wire.endpoint.receive(GROUND, header + b"abc" + b"\x00\x00")
    assert wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == ACCEPTED


def test_many_messages_are_cut_into_datagrams_at_message_borders(wire):
    wire.endpoint.bytes_to_send(GROUND)

    def asked(times):
        for _ in range(times):
            wire.say(GROUND, mavlink.MAVLink_param_request_list_message(1, 1))
        datagrams = wire.endpoint.bytes_to_send(GROUND)
        assert max(map(len, datagrams)) <= 1200
        return sum(len(parser_of().parse_buffer(d)) for d in datagrams)

    parameters = asked(1)
    assert parameters > 5
    assert asked(60) == 60 * parameters


@pytest.mark.parametrize("number", [24, 30, 32, 33, 36, 74, 1, 245, 140])
def test_every_stream_can_be_built_in_every_state(number):
    wire = Wire()
    for _ in range(3):
        message = wire.ask(command(mavlink.MAV_CMD_REQUEST_MESSAGE, float(number)))[0]
        assert message.get_msgId() == number
        wire.take_off()


def test_the_landed_state_follows_the_flight(wire):
    def state() -> int:
        answers = wire.ask(command(mavlink.MAV_CMD_REQUEST_MESSAGE, 245.0))
        return next(m.landed_state for m in answers if m.get_type() == "EXTENDED_SYS_STATE")

    assert state() == mavlink.MAV_LANDED_STATE_ON_GROUND
    wire.take_off()
    assert state() == mavlink.MAV_LANDED_STATE_TAKEOFF
    for _ in range(1000):
        wire.step()
    assert state() == mavlink.MAV_LANDED_STATE_IN_AIR
    wire.result(mavlink.MAV_CMD_NAV_LAND)
    assert state() == mavlink.MAV_LANDED_STATE_LANDING


def test_a_request_for_files_is_refused_at_once(wire):
    request = bytes([7, 0, 3, 4, 0, 0, 0, 0, 0, 0, 0, 0])  # sequence 7, session 3, open for reading
    (answer,) = wire.ask(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, request.ljust(251, b"\0")))
    assert (answer.target_system, answer.target_component) == STATION
    assert answer.payload[:13] == [8, 0, 3, 129, 1, 4, 0, 0, 0, 0, 0, 0, 7]

"""MAVLink FTP is refused at once: MAVProxy asks every component for its parameters as a file first."""

import struct

import pytest
from pymavlink.dialects.v20 import common as mav

from tests.companion.aircraft import aircraft

OPEN_FILE, ACK, NAK = 4, 128, 129
HEADER = struct.Struct("<HBBBBBxI")


@pytest.fixture
def plane():
    plane = aircraft()
    plane.heartbeat()
    return plane


def ask(plane, opcode, component=191, sequence=65535):
    payload = list((HEADER.pack(sequence, 3, opcode, 7, 0, 0, 42) + b"@PARAM/").ljust(251, b"\0"))
    heard = plane.deliver(mav.MAVLink_file_transfer_protocol_message(0, 1, component, payload), by=plane.ground)
    return [m for m in heard if m.get_type() == "FILE_TRANSFER_PROTOCOL"]


def test_a_request_is_refused_to_whom_asked_with_the_next_sequence_number(plane):
    (answer,) = ask(plane, OPEN_FILE)
    sequence, session, opcode, size, request, _, offset = HEADER.unpack(bytes(answer.payload[: HEADER.size]))
    assert (answer.target_system, answer.target_component) == (255, 190)
    assert (sequence, session, opcode, size, request, offset) == (0, 3, NAK, 1, OPEN_FILE, 42)
    assert answer.payload[HEADER.size] == 7


@pytest.mark.parametrize(("opcode", "component"), [(ACK, 191), (NAK, 191), (OPEN_FILE, 1), (OPEN_FILE, 0)])
def test_answers_and_requests_to_others_are_left_alone(plane, opcode, component):
    assert ask(plane, opcode, component) == []

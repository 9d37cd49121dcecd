"""The short way for messages at the full rate says what pymavlink says, byte for byte and fact for fact."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink import Codec, Speaker
from dob_companion.mavlink.frame import read_frame

real = st.floats(width=32)
stamps = st.integers(0, 2**64 - 1)


def by_pymavlink(data, system):
    """The facts of a datagram when the short way is closed: as a stream in two pieces."""
    codec = Codec(system, datagrams=False)
    return repr([*codec.facts(data[:1]), *codec.facts(data[1:])]), codec.counters.foreign


@given(stamps, st.tuples(*[real] * 8), st.sampled_from([0, 1, 2]), st.integers(1, 3), st.sampled_from([1, 2, 191]))
def test_samples_and_moments_read_the_same_either_way(stamp, values, group, system, component):
    sender = mav.MAVLink(None, srcSystem=system, srcComponent=component)
    imu = mav.MAVLink_highres_imu_message(stamp, *values, *values[:5], 0, 0)
    moment = mav.MAVLink_actuator_control_target_message(stamp, group, list(values))
    for message in (imu, moment):
        data = bytes(message.pack(sender))
        codec = Codec(2)
        facts = repr(list(codec.facts(data)))
        assert (facts, codec.counters.foreign) == by_pymavlink(data, 2)
        assert codec.counters.bad == 0


@given(stamps, st.tuples(*[st.floats(-1, 1, width=32)] * 3), st.integers(0, 300))
def test_a_correction_is_packed_as_pymavlink_packs_it(stamp, moment, said_before):
    speaker, other = Speaker(), mav.MAVLink(None, srcSystem=1, srcComponent=191)
    for _ in range(said_before):
        speaker.correction(0, (0.0, 0.0, 0.0))
    other.seq = said_before % 256
    expected = bytes(mav.MAVLink_debug_vect_message(b"DOB_CORR", stamp, *moment).pack(other))
    assert speaker.correction(stamp, moment) == expected
    other.seq = (other.seq + 1) % 256
    values = [*moment, *moment, 4.0, 1.0, 250.0]
    expected = bytes(mav.MAVLink_debug_float_array_message(stamp, b"DOB", 0, values + [0.0] * 49).pack(other))
    assert speaker.telemetry(stamp, values) == expected


@pytest.mark.parametrize("spoil", range(30))
def test_one_wrong_byte_closes_the_short_way(spoil):
    out = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    data = bytearray(mav.MAVLink_actuator_control_target_message(7, 0, np.linspace(0.1, 0.8, 8).tolist()).pack(out))
    known = {140: mav.MAVLink_actuator_control_target_message}
    assert read_frame(bytes(data), known)
    data[spoil] ^= 0x10
    assert read_frame(bytes(data), known) is None


@pytest.mark.parametrize("number", [0, 30, 105, 140])
@pytest.mark.parametrize("signed", [False, True])
def test_only_a_plain_frame_of_another_message_is_known_to_bring_no_gyro_sample(number, signed):
    frame = bytes([0xFD, 1, int(signed), 0, 0, 1, 1, number, 0, 0, 0, 0, 0]) + bytes(13 * signed)
    assert Codec(1).may_bring_sample(frame) == (number == 105)
    assert Codec(1).may_bring_sample(frame + frame)
    assert Codec(1).may_bring_sample(frame[:-1])
    assert Codec(1).may_bring_sample(b"")
    assert Codec(1, datagrams=False).may_bring_sample(frame)


def test_a_stream_whose_pieces_never_end_with_a_message_does_not_fill_the_memory():
    message = bytes(
        mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3).pack(mav.MAVLink(None, 1, 1))
    )
    codec, heard = Codec(1, datagrams=False), 0
    stream = message * 5000
    for at in range(10, len(stream), len(message)):
        heard += len(list(codec.facts(stream[max(0, at - len(message)) : at])))
    assert heard > 4000
    assert len(codec._parser.buf) < 10_000

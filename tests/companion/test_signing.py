"""MAVLink 2 signing: the gate against pymavlink's own signing, and what it must refuse."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.signing import MOST_STREAMS, OLDEST_NEW_STREAM, SigningGate, ticks

KEY, OTHER = bytes(range(32)), bytes(32)
NOW = ticks(1_800_000_000.0)


def peer(key=KEY, timestamp=NOW, link_id=7, system=255, component=190):
    """A pymavlink program that signs."""
    out = mav.MAVLink(None, srcSystem=system, srcComponent=component)
    out.robust_parsing = True
    if key is not None:
        out.signing.secret_key, out.signing.sign_outgoing = key, True
        out.signing.timestamp, out.signing.link_id = timestamp, link_id
    return out


def write(by, value=1.0):
    return bytes(mav.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", value, 9).pack(by))


def beat(by):
    return bytes(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3).pack(by))


def v1(message):
    return bytes(message.pack(mav.MAVLink(None, 1, 1), force_mavlink1=True))


def test_what_pymavlink_signs_passes_as_it_came():
    gate, other = SigningGate(KEY, NOW), peer()
    frames = [write(other), beat(other), write(other)]
    assert [gate.admit(frame) for frame in frames] == frames
    assert gate.counters.refused == 0


def test_what_the_gate_signs_pymavlink_accepts():
    gate, other = SigningGate(KEY, 0, link_id=3), peer(timestamp=0)
    quiet = peer(key=None, system=1, component=191)
    for now in (NOW, NOW, NOW - 1000, NOW + 5):  # a clock that stands and jumps back
        (found,) = other.parse_buffer(gate.sign(beat(quiet), now))
        assert (found.get_type(), found.get_signed(), found.get_link_id()) == ("HEARTBEAT", True, 3)
    assert other.signing.badsig_count == 0


@pytest.mark.parametrize(
    ("frame", "counter"),
    [
        (write(peer(key=None)), "unsigned"),
        (v1(mav.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9)), "unsigned"),
        (write(peer(key=OTHER)), "wrong"),
        (write(peer(timestamp=NOW - OLDEST_NEW_STREAM - 10)), "replayed"),
    ],
)
def test_unsigned_wrongly_signed_and_stale_frames_are_refused_and_counted(frame, counter):
    gate = SigningGate(KEY, NOW)
    assert gate.admit(frame) == b""
    assert (getattr(gate.counters, counter), gate.counters.refused, gate.counters.admitted) == (1, 1, 0)


def test_a_frame_counts_once():
    gate, other = SigningGate(KEY, NOW), peer()
    first, second = write(other), write(other, 0.0)
    assert gate.admit(first)
    assert gate.admit(second)
    assert gate.admit(first) == gate.admit(second) == b""
    assert gate.counters.replayed == 2


def test_streams_do_not_disturb_one_another():
    gate = SigningGate(KEY, NOW)
    assert gate.admit(beat(peer(timestamp=NOW + 1000, component=1, system=1)))
    assert gate.admit(write(peer(timestamp=NOW - 1000)))


def test_whoever_has_the_key_and_speaks_under_ever_new_ids_fills_no_memory():
    gate = SigningGate(KEY, NOW)
    others = [peer(system=1 + n % 250, component=1 + n // 250) for n in range(2 * MOST_STREAMS)]
    admitted = [bool(gate.admit(write(other))) for other in others]
    assert admitted == [True] * MOST_STREAMS + [False] * MOST_STREAMS
    later = peer(timestamp=NOW + 2 * OLDEST_NEW_STREAM, system=1, component=1)
    assert gate.admit(write(later))
    assert gate.admit(write(peer(timestamp=NOW + 2 * OLDEST_NEW_STREAM, system=200, component=9)))
    assert not gate.admit(write(peer(timestamp=NOW + 100, system=3, component=1)))  # forgotten, and too old to be new


def test_a_forged_frame_from_the_future_does_not_lock_its_victim_out():
    gate, other = SigningGate(KEY, NOW), peer()
    gate.admit(beat(other))
    gate.admit(write(peer(key=OTHER, timestamp=NOW + 10**9)))
    assert gate.admit(write(other))
    assert gate.counters.wrong == 1


@given(at=st.integers(0, 60), bit=st.integers(0, 7))
def test_one_bit_changed_anywhere_is_not_admitted(at, bit):
    frame = bytearray(write(peer()))
    frame[at % len(frame)] ^= 1 << bit
    assert SigningGate(KEY, NOW).admit(bytes(frame)) == b""


def test_a_torn_frame_costs_the_rest_of_its_datagram_nothing():
    gate, other = SigningGate(KEY, NOW), peer()
    torn, whole = write(other)[:20], beat(other)
    assert gate.admit(torn + whole) == whole
    assert gate.admit(torn) == b""
    assert gate.admit(beat(other))


@given(cuts=st.lists(st.integers(0, 400), max_size=12))
def test_a_byte_stream_in_any_pieces_gives_the_same_frames(cuts):
    other = peer()
    frames = [write(other), beat(other), write(other), beat(other)]
    unknown = b"\xfd\x05\x00\x00\x00\x01\x01\xff\xff\xff" + b"\xfd" * 5 + b"\0\0"
    stream = b"\x00\xfe" + frames[0] + b"noise" + frames[1] + unknown + frames[2] + frames[3] + beat(other) + bytes(300)
    gate = SigningGate(KEY, NOW, datagrams=False)
    edges = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    heard = b"".join(gate.admit(stream[a:b]) for a, b in itertools.pairwise(edges))
    assert all(frame in heard for frame in frames)
    assert gate.counters.refused == 0


@given(data=st.binary(max_size=400), datagrams=st.booleans())
def test_garbage_is_neither_admitted_nor_an_error(data, datagrams):
    gate = SigningGate(KEY, NOW, datagrams=datagrams)
    assert gate.admit(data) == b""


def test_timestamps_keep_increasing_over_a_restart_with_a_clock_that_stands_at_1970():
    before, quiet, listener = SigningGate(KEY, NOW), peer(key=None), peer(timestamp=0)
    frames = [before.sign(beat(quiet), NOW + 5)]
    after = SigningGate(KEY, before.timestamp)
    frames += [after.sign(beat(quiet), ticks(0.0)) for _ in range(2)]
    assert all(listener.parse_buffer(frame)[0].get_signed() for frame in frames)


def test_a_key_of_the_wrong_length_is_a_programmers_error():
    with pytest.raises(ValueError, match="32 bytes"):
        SigningGate(b"short", 0)

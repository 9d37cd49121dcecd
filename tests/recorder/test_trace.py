"""Traces that were cut, altered or made up: what is whole is read, what is not is named, nothing raises by surprise."""

import json
import re
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dob_companion.artifact import dumps
from dob_companion.errors import InputError
from dob_companion.files.playback import play_chunks
from dob_companion.files.segments import traces_at
from dob_companion.files.trace import (
    GZIP,
    Ending,
    FrameReader,
    Kind,
    count_item,
    frame,
    item,
    items,
    read_frames,
    time_item,
)
from dob_companion.flightlog.replay import Replay
from tests.companion.aircraft import small_design
from tests.effort import examples
from tests.recorder.flights import recorded, run


@pytest.fixture(scope="module")
def trace(tmp_path_factory):
    """The bytes of a short flight in which a correction is active."""
    directory = tmp_path_factory.mktemp("flights")
    with recorded(directory) as plane:
        plane.active()
        plane.rates = (0.1, 0.0, -0.1)
        plane.pairs(100)
    return traces_at(directory)[0].read_bytes()


@pytest.fixture
def on_disk(trace, tmp_path):
    def put(data=trace):
        path = tmp_path / "flight-0001-000.dobtrace"
        path.write_bytes(data)
        return path

    return put


def unpacked(trace):
    """Payloads of the frames."""
    return list(FrameReader().feed(zlib.decompress(trace, GZIP)))


def packed(payloads):
    stream = zlib.compressobj(1, wbits=GZIP)
    return stream.compress(b"".join(frame([payload]) for payload in payloads)) + stream.flush()


def replay_of(data):
    replay = Replay()
    return replay, play_chunks([data], replay, "trace")


def test_a_flight_replays_and_says_so(on_disk, capsys):
    code, out, err = run(capsys, "replay", on_disk())
    assert (code, err) == (0, "")
    assert "every byte that was said is computed again" in out
    code, out, _ = run(capsys, "replay", on_disk(), "--json")
    found = json.loads(out)
    assert (code, found["identical"], found["torn"], found["damaged"]) == (0, True, [], {})
    assert found["corrections"] > 700


def test_a_design_given_must_be_the_one_that_flew(on_disk, tmp_path, capsys):
    right, wrong = tmp_path / "right.json", tmp_path / "wrong.json"
    right.write_text(dumps(small_design())[0])
    wrong.write_text(dumps(small_design(delay_margin=4))[0])
    assert run(capsys, "replay", on_disk(), "--design", right)[0] == 0
    code, _, err = run(capsys, "replay", on_disk(), "--design", wrong)
    assert code == 2
    assert len(err.splitlines()) == 1
    assert re.search(r"flight-0001-000.dobtrace: .* flown with design \w{8}, not with \w{8}", err)


def test_one_bit_of_one_correction_is_found_and_named(trace, on_disk, capsys):
    payloads = unpacked(trace)
    mark = b"DOB_CORR"
    number = max(n for n, payload in enumerate(payloads) if mark in payload)
    at = payloads[number].index(mark) - 12 + 2
    altered = bytearray(payloads[number])
    altered[at] ^= 1
    payloads[number] = bytes(altered)
    code, out, _ = run(capsys, "replay", on_disk(packed(payloads)))
    assert code == 1
    assert re.search(r"turn \d+, t = [\d.]+ s: recorded .*, computed DEBUG_VECT .*DOB_CORR", out)


@pytest.mark.parametrize("change", ["left out", "put in"])
def test_a_message_too_few_or_too_many_is_found(trace, change):
    payloads = unpacked(trace)
    number = max(n for n, payload in enumerate(payloads) if b"DOB_CORR" in payload)
    parts = [item(each.kind, each.data) for each in items(payloads[number])]
    payloads[number] = b"".join([*parts, item(Kind.SAID, b"\xfd")] if change == "put in" else parts[:-1])
    replay, _ = replay_of(packed(payloads))
    assert "nothing" in replay.difference


def test_a_state_that_was_not_reached_by_computing_is_found(trace):
    payloads = unpacked(trace)
    state = items(payloads[1])[0].json
    later = json.dumps(state | {"loop.shaper.f": 0.25}).encode()
    replay, _ = replay_of(packed([*payloads, item(Kind.CHECKPOINT, later)]))
    assert "state" in replay.difference


def test_cut_anywhere_everything_before_is_read(trace):
    read = []
    for end in range(0, len(trace), 997):
        ending = Ending()
        read.append(len(list(read_frames([trace[:end]], ending))))
        assert ending.torn
        assert not ending.damage
    assert read == sorted(read)
    assert read[-1] > 0.9 * len(unpacked(trace))
    replay, ending = replay_of(trace[: len(trace) // 2])
    assert ending.torn
    assert replay.difference == ""
    assert replay.corrections > 100


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_an_altered_byte_is_named_and_what_stands_before_it_is_read(trace, on_disk, capsys, share):
    at = int(share * len(trace))
    code, out, _ = run(capsys, "replay", on_disk(trace[:at] + bytes([trace[at] ^ 0x55]) + trace[at + 1 :]), "--json")
    found = json.loads(out)
    assert code == 1
    assert found["damaged"]
    assert found["difference"] is None
    assert found["turns"] > 0.25 * share * len(unpacked(trace))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "an empty file"),
        (b"no gzip at all", "not a recorded flight"),
        (packed([time_item(Kind.TIME, 1.0)]), "header"),
        (packed([item(Kind.HEADER, b"{")]), "header"),
        (packed([item(Kind.HEADER, b'{"schema": "dob-companion/trace/9"}')]), "expected 'dob-companion/trace/2'"),
        (packed([item(Kind.HEADER, b'{"schema": "dob-companion/trace/2"}')]), "header.generator"),
        (packed([item(Kind.HEADER, b"[" * 100_000)]), "header"),
    ],
)
def test_a_file_that_is_no_trace_is_one_line_and_exit_2(on_disk, capsys, data, words):
    code, _, err = run(capsys, "replay", on_disk(data))
    assert code == 2
    assert len(err.splitlines()) == 1
    assert words in err
    assert "flight-0001-000.dobtrace" in err


@pytest.mark.parametrize("state", [b'{"loop.gone": 1}', b"[]", b'{"loop.shaper.f": {"x": 1}}'])
def test_a_state_of_another_version_is_one_line_and_exit_2(trace, on_disk, capsys, state):
    payloads = unpacked(trace)
    payloads[1] = item(Kind.CHECKPOINT, state)
    code, _, err = run(capsys, "replay", on_disk(packed(payloads)))
    assert code == 2
    assert len(err.splitlines()) == 1


def test_nothing_to_replay_is_said(tmp_path, capsys):
    assert "holds no recorded flight" in run(capsys, "replay", tmp_path)[2]
    assert "cannot be read" in run(capsys, "replay", tmp_path / "nowhere")[2]


class Deaf:
    def __getattr__(self, _):
        return lambda *_: None


@settings(max_examples=examples(150), deadline=None)
@given(st.lists(st.binary(max_size=60), max_size=6), st.integers(1, 50))
def test_made_up_frames_are_damage_or_one_line(payloads, size):
    data = packed(payloads)
    try:
        ending = play_chunks([data[i : i + size] for i in range(0, len(data), size)], Deaf(), "made up")
    except InputError:
        return
    assert not ending.torn


@settings(max_examples=examples(150), deadline=None)
@given(st.binary(max_size=300))
def test_bytes_from_anywhere_are_no_trace(data):
    with pytest.raises(InputError, match="made up"):
        play_chunks([data], Deaf(), "made up")


def test_items_read_back():
    ending = Ending()
    turn = [time_item(Kind.TIME, 1 / 3), item(Kind.RECEIVED, b"ab"), item(Kind.ADVANCED), count_item(7)]
    (found,) = read_frames([packed([b"".join(turn)])], ending)
    assert [each.kind for each in found] == [Kind.TIME, Kind.RECEIVED, Kind.ADVANCED, Kind.LOST]
    assert (found[0].seconds, found[1].data, found[3].count) == (1 / 3, b"ab", 7)
    assert not ending.torn

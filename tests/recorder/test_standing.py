"""What a recording says to every reader: where the companion stood, and each change of state, as data."""

import json
import zlib

import pytest

from dob_companion.errors import InputError
from dob_companion.files.segments import traces_at
from dob_companion.files.trace import GZIP, FrameReader, Kind, frame, item, items, json_item
from dob_companion.flightlog.standing import Standing, reason_given, state_named
from dob_companion.supervisor import State
from tests.companion.aircraft import texts
from tests.recorder.flights import recorded, run

WHOLE = {"system": 1, "profile": "sitl", "state": "ACTIVE", "parameters": {"DOB_ENABLE": 1.0}}


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The trace of a short flight that began to inject, and what its companion said."""
    directory = tmp_path_factory.mktemp("flights")
    with recorded(directory) as plane:
        plane.active()
    return traces_at(directory)[0], plane.said


def kept(path):
    """The items of a trace."""
    return [each for payload in FrameReader().feed(zlib.decompress(path.read_bytes(), GZIP)) for each in items(payload)]


def written(path, kept_items):
    stream = zlib.compressobj(1, wbits=GZIP)
    pieces = b"".join(frame([item(each.kind, each.data)]) for each in kept_items)
    path.write_bytes(stream.compress(pieces) + stream.flush())
    return path


def test_every_checkpoint_is_followed_by_where_the_companion_stood(flown):
    kinds = kept(flown[0])
    after = [kinds[n + 1] for n, each in enumerate(kinds) if each.kind is Kind.CHECKPOINT]
    assert after
    assert {each.kind for each in after} == {Kind.STANDING}
    first = Standing.read(after[0].json)
    assert (first.system, first.state, first.parameters["DOB_ENABLE"]) == (None, State.DISABLED, 0.0)
    assert "DOB_STATE" not in first.parameters
    assert Standing.read(first.as_json()) == first


def test_changes_of_state_are_recorded_as_they_were_said(flown):
    path, said = flown
    changes = [each.json for each in kept(path) if each.kind is Kind.CHANGED]
    told = [text for text in texts(said) if text.startswith("DOB ") and ": " in text]
    assert [f"DOB {state_named(one).name}: {reason_given(one)}" for one in changes] == told
    assert "ACTIVE" in [one["state"] for one in changes]


@pytest.mark.parametrize("name", WHOLE)
def test_what_a_reader_relies_on_and_does_not_find_is_named(name):
    lacking = {key: value for key, value in WHOLE.items() if key != name}
    with pytest.raises(InputError, match=f"does not say {name}, expected "):
        Standing.read(lacking)


@pytest.mark.parametrize(
    ("name", "value"),
    [("system", "1"), ("system", True), ("profile", "rover"), ("state", "ASLEEP"), ("state", []), ("parameters", [])],
)
def test_what_is_not_as_declared_is_named_with_what_was_expected(name, value):
    with pytest.raises(InputError, match=rf"{name} is .* in the recording, expected "):
        Standing.read(WHOLE | {name: value})


def test_a_recording_of_an_earlier_version_is_replayed_and_has_no_page_which_is_said_in_one_line(
    flown, tmp_path, capsys
):
    header, *rest = kept(flown[0])
    earlier = [each for each in rest if each.kind not in (Kind.STANDING, Kind.CHANGED)]
    said = json_item(Kind.HEADER, header.json | {"schema": "dob-companion/trace/1"})
    path = written(tmp_path / "flight-0001-000.dobtrace", [*items(said), *earlier])
    assert run(capsys, "replay", path)[0] == 0
    code, _, err = run(capsys, "report", path, "-o", tmp_path / "page.html")
    assert (code, len(err.splitlines())) == (2, 1)
    assert str(path) in err
    assert "did not record where the companion stands" in err
    assert header.json["generator"] in err


@pytest.mark.parametrize(
    ("kind", "change"), [(Kind.STANDING, {"state": "FAULT"}), (Kind.CHANGED, {"reason": "because"})]
)
def test_a_replay_finds_what_was_recorded_otherwise_than_it_is_computed(flown, tmp_path, capsys, kind, change):
    altered = [items(json_item(kind, each.json | change))[0] if each.kind is kind else each for each in kept(flown[0])]
    path = written(tmp_path / "flight-0001-000.dobtrace", altered)
    code, out, _ = run(capsys, "replay", path, "--json")
    assert code == 1
    assert next(iter(change.values())) in json.loads(out)["difference"]

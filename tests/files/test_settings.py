"""What the operator has set survives a restart, and a damaged file does not survive as a setting."""

import json

import pytest

from dob_companion.artifact import sha256_of
from dob_companion.companion.kept_parameters import SCHEMA, dump_parameters, load_parameters
from dob_companion.errors import ConfigError, InputError
from dob_companion.files import ParameterKeeper, recover_parameters
from dob_companion.files.background_writer import BackgroundWriter

VALUES = {"DOB_GAIN": 0.1, "DOB_LIMIT": 0.25}


def sealed(values, schema=SCHEMA):
    obj = {"schema": schema, "values": values}
    return json.dumps(obj | {"sha256": sha256_of(obj)})


def test_settings_read_back_bit_for_bit():
    assert load_parameters(dump_parameters(VALUES), "p.json") == VALUES


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[1]",
        "[" * 100_000,
        dump_parameters(VALUES)[:-20],
        dump_parameters(VALUES).replace("0.25", "0.75"),
        sealed(VALUES, schema="dob-companion/parameters/2"),
        sealed({"DOB_ENABLE": 1.0}),
        sealed({"DOB_STATE": 4.0}),
        sealed({"DOB_NOPE": 1.0}),
        sealed({"DOB_LIMIT": 1.5}),
        sealed({"DOB_LIMIT": None}),
        '{"schema": "' + SCHEMA + '", "values": {"DOB_LIMIT": NaN}, "sha256": ""}',
    ],
)
def test_a_torn_or_foreign_file_is_one_line_that_names_it(text):
    with pytest.raises(ConfigError, match=r"^p\.json: [^\n]+$"):
        load_parameters(text, "p.json")


def test_a_torn_file_gives_the_defaults_one_warning_and_is_kept_aside(tmp_path):
    torn = dump_parameters(VALUES)[:40]
    (tmp_path / "parameters.json").write_text(torn)
    values, warning = recover_parameters(tmp_path)
    assert values == {}
    assert "parameters.json" in warning
    assert "\n" not in warning
    assert (tmp_path / "parameters.json.damaged").read_text() == torn
    assert recover_parameters(tmp_path) == ({}, None)


def test_bytes_that_are_no_text_are_a_damaged_file_too(tmp_path):
    (tmp_path / "parameters.json").write_bytes(b"\xff\x00\xfe")
    assert recover_parameters(tmp_path)[1] is not None


def test_what_an_interrupted_write_left_behind_is_cleared_away(tmp_path):
    (tmp_path / "parameters.json").write_text(dump_parameters(VALUES))
    (tmp_path / ".parameters.json.x7fe").write_text("half")
    assert recover_parameters(tmp_path) == (VALUES, None)
    assert [path.name for path in tmp_path.iterdir()] == ["parameters.json"]


def test_a_state_directory_that_cannot_be_made_is_an_input_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file"):
        recover_parameters(tmp_path / "file")


def test_the_newest_settings_are_on_disk_when_the_writer_has_left(tmp_path):
    with BackgroundWriter(tmp_path / "parameters.json", complain=pytest.fail) as writer:
        keeper = ParameterKeeper(writer, {"DOB_GAIN": 0.5})
        for limit in range(100):
            keeper.keep({"DOB_LIMIT": limit / 100})
    assert recover_parameters(tmp_path) == ({"DOB_GAIN": 0.5, "DOB_LIMIT": 0.99}, None)


def test_nothing_is_written_while_nothing_was_set(tmp_path):
    with BackgroundWriter(tmp_path / "parameters.json", complain=pytest.fail) as writer:
        ParameterKeeper(writer, {}).keep({})
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_refuses_is_said_once_and_the_writer_lives_on(tmp_path):
    said = []
    with BackgroundWriter(tmp_path / "gone" / "parameters.json", said.append) as writer:
        writer.put("a")
        writer.put("b")
    assert len(said) == 1
    assert "missed after a restart" in said[0]

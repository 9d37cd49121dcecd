"""The parameter protocol as ground stations speak it (docs/interfaces.md, Parameters)."""

import struct

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import PARAMETERS, CompanionConfig, parse_config
from dob_companion.companion.parameters import in_words
from dob_companion.errors import ConfigError
from dob_companion.supervisor import State
from tests.companion.aircraft import aircraft, texts

NAMES = [spec.name for spec in PARAMETERS]


def values(messages):
    return [(m.param_id, m.param_value, m.param_index) for m in messages if m.get_type() == "PARAM_VALUE"]


def errors(messages):
    return [(m.param_id, m.error) for m in messages if m.get_type() == "PARAM_ERROR"]


@pytest.fixture
def plane():
    plane = aircraft()
    plane.heartbeat()
    return plane


@pytest.mark.parametrize("target", [0, 191])
def test_a_list_request_is_answered_with_all_parameters_under_own_count_and_index_as_real32(plane, target):
    heard = plane.deliver(mav.MAVLink_param_request_list_message(1, target), by=plane.ground)
    found = [m for m in heard if m.get_type() == "PARAM_VALUE"]
    assert [m.param_id for m in found] == NAMES
    assert [m.param_index for m in found] == list(range(len(NAMES)))
    assert {m.param_count for m in found} == {len(NAMES)}
    assert {m.param_type for m in found} == {mav.MAV_PARAM_TYPE_REAL32}
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in found} == {(1, 191)}


def test_a_flood_of_list_requests_is_answered_four_times_a_second(plane):
    request = mav.MAVLink_param_request_list_message(1, 191)

    def lists(seconds):
        plane.now += seconds
        return len(values(plane.deliver(*[request] * 100, by=plane.ground))) / len(NAMES)

    assert lists(0.0) == 4
    assert lists(0.1) == 0
    lists(1.0)  # its requests come before the second is noticed
    assert lists(0.1) == 4


def test_a_list_request_to_another_component_is_none_of_our_business(plane):
    assert values(plane.deliver(mav.MAVLink_param_request_list_message(1, 1), by=plane.ground)) == []


def test_a_parameter_is_read_by_name_and_by_index(plane):
    by_name = plane.deliver(mav.MAVLink_param_request_read_message(1, 191, b"DOB_LIMIT", -1), by=plane.ground)
    by_index = plane.deliver(mav.MAVLink_param_request_read_message(1, 191, b"", 3), by=plane.ground)
    assert values(by_name) == values(by_index) == [("DOB_LIMIT", pytest.approx(0.3), 3)]


def test_a_write_is_taken_and_echoed(plane):
    assert values(plane.write("DOB_GAIN", 0.5)) == [("DOB_GAIN", 0.5, NAMES.index("DOB_GAIN"))]
    assert plane.companion.parameters["DOB_GAIN"] == 0.5


def test_a_write_to_everybody_is_taken_when_the_name_is_ours_and_left_alone_otherwise(plane):
    assert values(plane.write("DOB_GAIN", 0.5, component=0))
    assert plane.write("ATC_RAT_PIT_P", 0.5, component=0) == []


@pytest.mark.parametrize(
    ("name", "value", "error"),
    [
        ("DOB_NOPE", 1.0, 1),
        ("DOB_GAIN", 1.5, 2),
        ("DOB_GAIN", float("nan"), 2),
        ("DOB_LIMIT", float("inf"), 2),
        ("DOB_ENABLE", 0.5, 2),
        ("DOB_AXES", 8.0, 2),
        ("DOB_STATE", 4.0, 5),
    ],
)
def test_a_refused_write_gets_a_param_error_and_changes_nothing(plane, name, value, error):
    before = {spec.name: plane.companion.parameters[spec.name] for spec in PARAMETERS}
    heard = plane.write(name, value)
    assert errors(heard) == [(name, error)]
    assert {spec.name: plane.companion.parameters[spec.name] for spec in PARAMETERS} == before
    if name in before:
        assert values(heard)[0][:2] == (name, pytest.approx(before[name]))


def test_an_error_goes_to_whom_asked(plane):
    (error,) = [m for m in plane.write("DOB_NOPE", 1.0) if m.get_type() == "PARAM_ERROR"]
    assert (error.target_system, error.target_component) == (255, 190)


@pytest.mark.parametrize("kind", [mav.MAV_PARAM_TYPE_INT32, mav.MAV_PARAM_TYPE_UINT8, mav.MAV_PARAM_TYPE_INT16])
@pytest.mark.parametrize("wanted", [0, 1])
def test_an_integer_write_is_understood_by_value_and_byte_by_byte(plane, kind, wanted):
    (bytewise,) = struct.unpack("<f", struct.pack("<i", wanted))
    for value in (float(wanted), bytewise):
        plane.write("DOB_ENABLE", 1.0 - wanted)
        assert values(plane.write("DOB_ENABLE", value, kind)) == [("DOB_ENABLE", float(wanted), 0)]


def test_enable_starts_at_zero_and_the_configured_values_hold():
    plane = aircraft(parse_config("[parameters]\nDOB_GAIN = 0.7\nDOB_AXES = 2", "c.toml"))
    assert plane.companion.parameters["DOB_ENABLE"] == 0.0
    assert plane.companion.parameters["DOB_GAIN"] == 0.7
    assert plane.companion.parameters["DOB_AXES"] == 2.0


def test_dob_state_shows_what_the_supervisor_does(plane):
    plane.pairs(600)
    plane.write("DOB_ENABLE", 1.0)
    plane.until(State.ACTIVE)
    heard = plane.deliver(mav.MAVLink_param_request_read_message(1, 191, b"DOB_STATE", -1), by=plane.ground)
    assert values(heard) == [("DOB_STATE", 4.0, NAMES.index("DOB_STATE"))]


def test_enabling_without_samples_is_accepted_and_waits(plane):
    assert values(plane.write("DOB_ENABLE", 1.0)) == [("DOB_ENABLE", 1.0, 0)]
    assert plane.companion.status().state is State.WAITING
    assert any("WAITING" in text for text in texts(plane.said))


def test_a_parameter_id_that_is_no_text_is_answered_and_harmless(plane):
    plane.deliver(mav.MAVLink_param_set_message(1, 191, b"\xff\xfe\x80", 1.0, 9), by=plane.ground)
    assert values(plane.write("DOB_GAIN", 0.5))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sistem = 1", ("'sistem'", "did you mean 'system'?")),
        ("system = 300", ("system: expected a whole number from 1 to 255, got 300",)),
        ("correction_message = 'DEBUG'", ("correction_message", "DEBUG_VECT")),
        ("[parameters]\nDOB_LIMT = 1", ("parameters: ", "'DOB_LIMT'", "'DOB_LIMIT'")),
        ("[parameters]\nDOB_LIMIT = 2", ("parameters: DOB_LIMIT: expected a number from 0 to 1, got 2",)),
        ("[parameters]\nDOB_AXES = 1.5", ("parameters: DOB_AXES: expected a whole number",)),
        ("[parameters]\nDOB_STATE = 1", ("parameters: ", "'DOB_STATE'")),
        ("parameters = 3", ("parameters", "table")),
        ("[record]\nsegment = 4", ("record: ", "'segment'", "did you mean 'segments'?")),
        ("[record]\nsegments = 1", ("record: segments: expected a whole number from 2", "got 1")),
        ("[record]\nsegments = 4.0", ("record: segments: expected a whole number", "got 4.0")),
        ("[record]\nmb = nan", ("record: mb: expected a number from 0.1 to 1e+06, got nan",)),
        ("[record]\nmb = 0.05", ("record: mb: ", "got 0.05")),
        ("[record]\ndir = ''", ("record: dir: expected a path, got ''",)),
        ("record = 'flights'", ("record", "table")),
        ("[regime]\nthrotle_floor = 0", ("regime: ", "'throttle_floor'")),
        ("zzzzzz = 1", ("'zzzzzz'", "known keys: system, ")),
        ("system = ", ("not TOML",)),
    ],
)
def test_a_bad_configuration_is_one_line_that_names_the_key(text, words):
    with pytest.raises(ConfigError) as caught:
        parse_config(text, "c.toml")
    assert str(caught.value).startswith("c.toml: ")
    assert all(word in str(caught.value) for word in words)


def test_an_empty_configuration_is_the_default():
    assert parse_config("", "c.toml") == CompanionConfig()


def told(plane):
    return [event.text for event in plane.companion.events() if event.text.startswith("parameter")]


def test_each_write_is_told_with_what_it_was_before_and_who_sent_it(plane):
    plane.write("DOB_GAIN", 0.5)
    plane.write("DOB_GAIN", 0.5)
    plane.write("DOB_LIMIT", 0.3)
    assert told(plane) == [
        "parameter DOB_GAIN: 0.5, was 1 (written by system 255, component 190)",
        "parameter DOB_GAIN: 0.5, as before (written by system 255, component 190)",
        "parameter DOB_LIMIT: 0.3, as before (written by system 255, component 190)",
    ]


def test_a_refused_write_is_told_with_the_reason_and_another_components_is_not(plane):
    plane.write("DOB_GAIN", 5.0)
    plane.write("DOB_NO\nPE", 1.0)
    plane.write("ATC_RAT_PIT_P", 0.5, component=0)
    assert told(plane) == [
        "parameter DOB_GAIN: 5 refused, value out of range (written by system 255, component 190)",
        "parameter 'DOB_NO\\nPE': 1 refused, does not exist (written by system 255, component 190)",
    ]


def test_a_flood_of_writes_is_answered_in_full_and_told_in_part(plane):
    for k in range(500):
        assert values(plane.write("DOB_GAIN", (k % 100) / 100))
    plane.now += 1.0
    plane.companion.advance(plane.now)
    lines = told(plane)
    assert len(lines) == 11
    assert lines[-1] == "parameters: 490 more writes within a second"
    plane.write("DOB_GAIN", 1.0)
    assert len(told(plane)) == 1


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("DOB_ENABLE", 0, "off"),
        ("DOB_ENABLE", 1, "on"),
        ("DOB_AXES", 7, "roll, pitch, yaw"),
        ("DOB_AXES", 5, "roll, yaw"),
        ("DOB_AXES", 0, "none"),
        ("DOB_LIMIT", 0.3, "normalized torque"),
        ("DOB_RAMP_S", 0.5, "s"),
        ("DOB_GAIN", 1, ""),
        ("DOB_STATE", State.ACTIVE, "ACTIVE"),
        ("DOB_STATE", 99, ""),
        ("DOB_STATE", float("nan"), ""),
        ("NOT_OURS", 1, ""),
    ],
)
def test_a_value_is_put_in_words(name, value, words):
    assert in_words(name, value) == words

"""`dob-companion param` and `status` beside a vehicle that routes, with a companion and without one."""

import json
from datetime import datetime

import pytest
from mavsdk import logging as mavsdk_logging

from dob_companion.companion import PARAMETERS
from dob_companion.errors import NoVehicleError
from dob_companion.ground import GroundStation
from dob_companion.runtime.urls import LinkUrl
from tests.cli.processes import one_line, run_cli
from tests.clients.processes import flying, process
from tests.ports import free_port


@pytest.fixture(scope="module")
def ground(design):
    with flying(design, "ardupilot") as port:
        yield f"udp:{port}"


def param(link, *more):
    return run_cli("param", *more, "--link", link)


def test_the_list_has_units_words_ranges_and_meanings_and_fits_a_terminal(ground):
    finished = param(ground, "list")
    assert finished.returncode == 0, finished.stderr
    lines = finished.stdout.splitlines()
    assert [line.split()[0] for line in lines] == [spec.name for spec in PARAMETERS]
    assert max(map(len, lines)) <= 80
    for line, spec in zip(lines, PARAMETERS, strict=True):
        assert line.endswith(spec.meaning)
    assert lines[1].split()[1:5] == ["7", "roll,", "pitch,", "yaw"]
    assert lines[3].split()[1:5] == ["0.3", "normalized", "torque", "0…1"]
    assert lines[5].split()[1:4] == ["0", "DISABLED", "read-only"]


def test_json_gives_the_digits_that_were_written(ground):
    assert json.loads(param(ground, "get", "DOB_LIMIT", "--json").stdout) == {"DOB_LIMIT": 0.3}


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (("set", "DOB_GAIN", "5"), "DOB_GAIN is 0…1"),
        (("set", "DOB_STATE", "2"), "read only"),
        (("get", "DOB_GIAN"), "did you mean 'DOB_GAIN'?"),
    ],
)
def test_a_refusal_says_what_would_have_been_taken(ground, what, words):
    finished = param(ground, *what)
    assert finished.returncode == 1
    assert words in one_line(finished)


def test_status_as_json_says_when(ground):
    seen = json.loads(run_cli("status", "--json", "--link", ground).stdout)
    assert datetime.fromisoformat(seen["time"]).utcoffset().total_seconds() == 0.0


@pytest.mark.parametrize("what", [("list",), ("set", "DOB_GAIN", "1")], ids=" ".join)
def test_without_a_companion_the_answer_is_one_line_and_exit_1(what):
    port = free_port()
    with process("-m", "tests.clients.vehicle", "px4", free_port(), port):
        finished = run_cli("param", *what, "--link", f"udpin:127.0.0.1:{port}", "--timeout", "1.5")
    assert finished.returncode == 1
    assert finished.stdout == ""
    assert "companion (component 191) does not answer" in one_line(finished)


def test_a_further_station_leaves_what_mavsdk_calls_in_the_threads_of_the_others():
    """Two rehearsed flights at once ended in SIGSEGV now and then: subscribing again frees the callback before."""
    called = mavsdk_logging._log_callback_ref
    with pytest.raises(NoVehicleError):
        GroundStation(LinkUrl("udpin", "127.0.0.1", free_port()), 0.0)
    assert called is not None
    assert mavsdk_logging._log_callback_ref is called

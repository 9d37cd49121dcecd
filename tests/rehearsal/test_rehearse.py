"""`dob-companion rehearse`: real processes over real sockets, and what is made of what they fly."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dob_companion.artifact import dumps
from dob_companion.cli.main import main
from dob_companion.rehearsal import Rehearsal
from dob_companion.rehearsal.members import Member
from dob_companion.rehearsal.verdict import Outcome, failed, rehearsal_table, weakest
from tests.cli.processes import one_line, run_cli
from tests.recorder.flights import wait_until
from tests.rehearsal.test_family import designed

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A family with twelve samples of delay that nobody knew of: no rate loop bears that, so one aircraft flies."""
    directory = tmp_path_factory.mktemp("design")
    (directory / "design.json").write_text(dumps(designed("delay_samples = [0, 12]"))[0])
    return directory / "rehearsal", run_cli("rehearse", directory, timeout=None)


def test_an_aircraft_of_the_family_that_fails_is_exit_1_and_named_with_its_reason(flown):
    out, finished = flown
    assert finished.returncode == 1
    assert "2 of 3 aircraft failed: delay: " in one_line(finished)
    assert "pitch: the rate loop without an observer is unstable" in one_line(finished)
    found = json.loads((out / "rehearsal.json").read_text())
    assert found["schema"] == "dob-companion/rehearsal/1"
    assert not found["usable"]
    assert [(m["name"], m["passed"]) for m in found["members"]] == [
        ("nominal", True),
        ("delay", False),
        ("worst", False),
    ]
    assert found["members"][1]["changed"] == {"pitch": "12 more samples of delay"}
    assert found["members"][1]["axes"] == {"pitch": None}


def test_the_model_is_flown_with_the_observer_on_throughout(flown):
    out, finished = flown
    result = json.loads((out / "nominal" / "result.json").read_text())
    member = json.loads((out / "rehearsal.json").read_text())["members"][0]
    assert member["axes"]["pitch"]["rms_ratio"] == result["axes"]["pitch"]["rms_ratio"] > 2.0
    with np.load(out / "nominal" / "flight.npz") as trace:
        assert set(trace["state"][trace["window"] == 2]) == {-1, 4}
        assert np.max(np.abs(trace["attitude_error"][trace["window"] == 1][:, 1])) < 0.07
    row = next(line for line in finished.stdout.splitlines() if line.startswith("nominal"))
    assert row.split() == ["nominal", f"{result['axes']['pitch']['rms_ratio']:.2f}", "ok"]


def test_the_page_has_every_aircraft_and_the_flight_of_the_model(flown):
    page = (flown[0] / "report.html").read_text()
    assert all(f'data-member="{name}"' in page for name in ("nominal", "delay", "worst"))
    assert 'data-key="overview-nominal"' in page
    assert "Not usable as it is: delay and worst failed." in page


@pytest.mark.parametrize(("make", "script"), [("ArduPilot", True), ("PX4", False), ("", False), (None, False)])
def test_an_ardupilot_that_was_identified_is_rehearsed_with_its_script(tmp_path, make, script):
    if make is not None:
        (tmp_path / "identification.json").write_text(json.dumps({"make": make}))
    assert Rehearsal(directory=tmp_path, out=tmp_path / "out").scripted is script
    assert Rehearsal(directory=tmp_path, out=tmp_path / "out", script=True).scripted


@pytest.mark.parametrize(("content", "words"), [(None, "design.json"), ("{", "design.json: not JSON")])
def test_a_directory_without_a_sound_design_is_refused_in_one_line(tmp_path, capsys, content, words):
    if content is not None:
        (tmp_path / "design.json").write_text(content)
    assert main(["rehearse", str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1
    assert not (tmp_path / "rehearsal").exists()


def outcome(name="nominal", ratio=3.0, *, steady=True, said="", flown=True):
    member = Member(name, {"roll": "as designed for", "pitch": "as designed for"}, {})
    result = {"axes": {"roll": {"rms_ratio": 2.0 * ratio}, "pitch": {"rms_ratio": ratio}, "yaw": {"rms_ratio": 0.1}}}
    return Outcome(member=member, result=result if flown else None, steady=steady, said=said)


def test_usable_means_that_it_flew_stayed_on_and_brought_something_in_every_axis_of_the_design():
    assert outcome().why == ""  # yaw is none of the design's
    assert outcome(ratio=0.8).why == "off/on below 1: pitch 0.80"
    assert outcome(steady=False, said="roll rings").why == "the observer did not stay on: roll rings"
    assert outcome(flown=False, said="it came down").why == "it came down"
    family = [outcome(), outcome("gain low", 1.5), outcome("worst", 9.0, steady=False, said="roll rings")]
    assert failed(family[:2]) == ""
    assert failed(family) == "1 of 3 aircraft failed: worst: the observer did not stay on: roll rings"
    assert weakest(family[:2]).member.name == "gain low"
    assert weakest(family).member.name == "worst"
    assert rehearsal_table(family).splitlines()[2].split() == ["gain", "low", "3.00", "1.50", "ok"]


def test_ctrl_c_ends_every_flight_at_once_and_leaves_no_process(tmp_path):
    (tmp_path / "design.json").write_text(dumps(designed("gain = [0.9, 1.1]"))[0])
    process = subprocess.Popen(
        [sys.executable, "-X", "faulthandler", "-m", "dob_companion", "rehearse", tmp_path],
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_until(lambda: (tmp_path / "rehearsal" / "nominal" / "companion.log").exists() and len(children(process)) > 1)
    family = children(process)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate()
    assert (process.returncode, errors) == (130, "")
    wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in family))
    assert not (tmp_path / "rehearsal" / "rehearsal.json").exists()


def children(process):
    """Of every thread."""
    tasks = Path(f"/proc/{process.pid}/task").glob("*/children")
    return {int(pid) for task in tasks for pid in task.read_text().split()}


@pytest.mark.proof  # a whole family
def test_a_robust_design_is_usable_over_all_that_it_was_designed_for(tmp_path):
    made = run_cli("design", EXAMPLES / "robust_pitch.toml", "-o", tmp_path, timeout=None)
    assert made.returncode == 0
    finished = run_cli("rehearse", tmp_path, "--json", timeout=None)
    assert finished.returncode == 0, finished.stderr
    found = json.loads(finished.stdout)
    assert found == json.loads((tmp_path / "rehearsal" / "rehearsal.json").read_text())
    assert len(found["members"]) == 7
    assert all(m["axes"]["pitch"]["rms_ratio"] > 2.0 for m in found["members"])

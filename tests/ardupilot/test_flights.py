"""The script and the companion in ArduCopter's own simulator. Found by DOB_ARDUCOPTER, the path of its program.

Minutes of real time each; `make proof`. tests/ardupilot/test_script.py holds the behaviour of the script without it.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
pytestmark = [
    pytest.mark.proof,
    pytest.mark.skipif(
        "DOB_ARDUCOPTER" not in os.environ, reason="no ArduCopter: DOB_ARDUCOPTER is to be the path of its simulator"
    ),
]


def run(module, *arguments, timeout):
    finished = subprocess.run(
        [sys.executable, "-m", f"tests.ardupilot.{module}", *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


@pytest.fixture(scope="module")
def hover(tmp_path_factory):
    """What `tests.ardupilot.checks` found in one hover."""
    return json.loads(run("checks", tmp_path_factory.mktemp("hover"), timeout=400).splitlines()[-1])


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    """The design of examples/ardupilot_copter.toml."""
    directory = tmp_path_factory.mktemp("design")
    command = ["design", "examples/ardupilot_copter.toml", "--auto", "-o", directory]
    subprocess.run([sys.executable, "-m", "dob_companion", *map(str, command)], cwd=ROOT, check=True, timeout=900)
    return directory / "design.json"


def test_what_is_added_is_what_the_rate_controller_has_to_take_back(hover):
    assert hover["neutral"]["added"] == 0.0
    assert abs(hover["neutral"]["controller"]) < 0.002
    for stage in ("added", "switched on", "back"):
        assert hover[stage]["added"] == pytest.approx(0.05, abs=1e-6)
        assert hover[stage]["controller"] == pytest.approx(-0.05, abs=0.002)
    assert hover["integrator while added"] == pytest.approx(-0.05, abs=0.003)


def test_the_pilots_switch_takes_it_out(hover):
    assert hover["switched off"]["added"] == 0.0
    assert abs(hover["switched off"]["controller"]) < 0.002


def test_in_silence_it_is_gone_within_a_quarter_of_a_second(hover):
    silence = np.array(hover["silence"])
    assert np.all(np.diff(silence[:, 1]) <= 1e-9)
    last = silence[silence[:, 1] > 0.0, 0][-1]
    assert last - silence[0, 0] < 0.25  # 0.1 s held, 0.1 s faded, and how often the script runs


def test_the_end_of_scripting_leaves_nothing_in_the_mixer(hover):
    assert abs(hover["integrator after the end of the script"]) < 0.005
    assert abs(hover["roll after the end of the script"]) < 0.02
    assert hover["altitude"] == pytest.approx(20.0, abs=1.0)


def test_it_answers_often_enough(hover):
    assert hover["neutral"]["rate_hz"] > 120.0
    assert hover["neutral"]["age"] < 4.0


def rows(design, directory, *programs):
    run("flights", design, "-o", directory, *programs, timeout=1200)
    return {(row["program"], row["axis"]): row for row in json.loads((directory / "result.json").read_text())}


def test_disturbances_are_rejected_in_flight(design, tmp_path):
    found = rows(design, tmp_path)
    ratio = {key: row["rms_off"] / row["rms_on"] for key, row in found.items()}
    for axis in ("roll", "pitch", "yaw"):
        assert ratio["calm", axis] >= 1.0
        assert ratio[f"noise-{axis}", axis] >= 10.0
        step = found[f"step-{axis}", axis]
        assert step["estimate_on"] == pytest.approx(step["true"], rel=0.02)
    for axis in ("roll", "pitch"):
        assert ratio[f"sine-{axis}", axis] >= 25.0
    assert not any("gap" in text for row in found.values() for text in row["said"])

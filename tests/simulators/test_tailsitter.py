"""ArduPlane's tail-sitter in ArduPilot's own simulator: hover and transition. Found by DOB_ARDUPLANE, the path of its
program. Minutes of real time; `make proof`. What it says on the wire is heard again, and what the script does out of
hover is held, without it: tests/ardupilot/test_recorded_tailsitter.py, tests/ardupilot/test_script.py.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GONE_S = 0.25
"""Time in which the correction is out of the mixer, command and reports on their way included."""

pytestmark = [
    pytest.mark.proof,
    pytest.mark.skipif(
        "DOB_ARDUPLANE" not in os.environ, reason="no ArduPlane: DOB_ARDUPLANE is to be the path of its simulator"
    ),
]


def run(module, *arguments, timeout):
    command = [sys.executable, "-m", module, *map(str, arguments)]
    finished = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=timeout, check=False)
    assert finished.returncode == 0, finished.stderr


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    """The design of examples/ardupilot_tailsitter.toml."""
    directory = tmp_path_factory.mktemp("design")
    run("dob_companion", "design", "examples/ardupilot_tailsitter.toml", "--auto", "-o", directory, timeout=900)
    return directory / "design.json"


def test_disturbances_are_rejected_in_hover(design, tmp_path):
    run("tests.ardupilot.flights", design, "--tailsitter", "-o", tmp_path, timeout=1200)
    for row in json.loads((tmp_path / "result.json").read_text()):
        ratio = row["not_done_off"] / row["not_done_on"]
        shape, _, axis = row["program"].partition("-")
        if shape == "step":
            assert row["estimate_on"] == pytest.approx(row["true"], rel=0.05)
        elif shape != "calm":
            assert ratio >= {"sine": 25.0, "noise": 4.0 if axis == "yaw" else 10.0}[shape]


def test_in_forward_flight_nothing_acts_and_back_in_hover_it_returns(design, tmp_path):
    run("tests.simulators.transition", design, "-o", tmp_path, timeout=600)
    found = json.loads((tmp_path / "result.json").read_text())
    said = [text for _, text in found["said"]]
    assert found["largest before"] > 0.01
    assert found["zero after s"] < GONE_S
    assert found["reports on its wing"] > 1000
    assert found["largest on its wing"] == 0.0
    assert "DOBC: not in hover" in said
    assert any(text.endswith("RAMP_OUT: not in multicopter mode") for text in said)
    assert found["active again s"] > found["in hover s"]

"""`identify` and `check` as processes: on the link of the simulated vehicle, whose pitch axis is the paper's (11)."""

import json
from pathlib import Path

import numpy as np
import pytest

from dob_companion.lti.response import response
from dob_companion.synthesis.plant.models import to_state_space
from dob_companion.synthesis.spec.parse import parse_spec
from tests.cli.processes import one_line, run_cli, run_here
from tests.clients.processes import process
from tests.ports import free_port

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER = EXAMPLES / "tailsitter_paper.toml"
ACCELERATION = 0.14131 * (1.0 + 1.716) / (1.0 - 0.9447) / 0.004
"""Of (11) once its lag has passed, rad/s² per unit of torque."""


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """The pitch axis in the simulated vehicle's hover, no model given."""
    out, port, ground = tmp_path_factory.mktemp("identified"), free_port(), free_port()
    links = ("--link", f"udpout:127.0.0.1:{port}", "--gcs", f"udpout:127.0.0.1:{ground}")
    with process("-m", "sitl", "--clock", "lockstep", *links):
        finished = run_cli(
            *("identify", "--link", f"udpin:127.0.0.1:{port}", "--axis", "pitch", "--seconds", "8", "-o", out),
            "--json",
        )
    assert finished.returncode == 0, finished.stderr
    return out, json.loads(finished.stdout.splitlines()[-1])


def test_the_plant_is_found_over_the_link_with_its_interval_and_is_a_spec_that_design_takes(identified):
    out, told = identified
    found = told["axes"]["pitch"]
    gain = found["acceleration_per_unit"]
    assert found["usable"]
    assert gain["low"] <= gain["value"] <= gain["high"]
    assert gain["value"] == pytest.approx(ACCELERATION, rel=0.02)
    assert found["lag_s"]["value"] == pytest.approx(0.0703, rel=0.05)
    assert told == json.loads((out / "identification.json").read_text(encoding="utf-8"))
    spec = parse_spec((out / "spec.toml").read_text(encoding="utf-8"))
    assert [block.name for block in spec.blocks] == ["pitch"]
    assert "delay_samples = 1   # measured while it was excited: 95 % within 1" in (out / "spec.toml").read_text()
    assert spec.blocks[0].uncertainty is not None
    assert "Usable." in (out / "identification.html").read_text(encoding="utf-8")


def test_the_same_log_says_the_same_and_that_the_papers_model_holds(identified, tmp_path):
    out, told = identified
    log = out / "excitation" / "excite.tlog"
    again = run_here("identify", "--log", log, "--axis", "pitch", "-o", tmp_path, "--json")
    assert json.loads(again.stdout)["axes"] == told["axes"]
    design = tmp_path / "design.json"
    text = PAPER.read_text(encoding="utf-8")
    head, pitch = text.partition("[[block]]")[0], text.partition("[[block]]")[2].partition("[[block]]")[0]
    (tmp_path / "pitch.toml").write_text(f"{head}[[block]]{pitch}", encoding="utf-8")
    assert run_here("design", tmp_path / "pitch.toml", "-o", tmp_path).returncode == 0
    checked = run_here("check", "--log", log, "--design", design, "--json")
    assert checked.returncode == 0, checked.stderr + checked.stdout
    axis = json.loads(checked.stdout)["axes"]["pitch"]
    assert axis["holds"]
    assert axis["gain"]["value"] == pytest.approx(1.0, abs=0.02)
    assert axis["delay_s"]["value"] == pytest.approx(0.0, abs=4e-4)


def test_the_vehicle_s_own_parameters_tell_its_controllers(identified):
    """No spec was given: C in the spec that came is the paper's (12), from the vehicle's gains."""
    out, _ = identified
    (block,) = parse_spec((out / "spec.toml").read_text(encoding="utf-8")).blocks
    (paper,) = (each for each in parse_spec(PAPER.read_text(encoding="utf-8")).blocks if each.name == "pitch")
    own, true = (to_state_space(each.controller, 0.004, (1, 1)) for each in (block, paper))
    angles = np.geomspace(1e-3, 3.0, 30)
    assert response(own, angles) == pytest.approx(response(true, angles), rel=1e-5)


def test_a_file_that_is_no_log_is_one_line(tmp_path):
    finished = run_here("identify", "--log", PAPER, "-o", tmp_path / "out")
    assert finished.returncode == 2
    assert str(PAPER) in one_line(finished)
    assert not (tmp_path / "out").exists()

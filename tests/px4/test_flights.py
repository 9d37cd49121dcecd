"""The module and the companion in PX4's own simulator. Found by DOB_PX4, the path of its program.

Minutes of real time each; `make proof`. tests/px4/test_core.py holds the behaviour of the module without it.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dob_companion.artifact import loads
from tests.px4.steady import gain_at_rest

ROOT = Path(__file__).parents[2]
SPARE = 1.15
"""What may be left on, over what the design has promised of the disturbance before the flight and what is there in calm
air, by the gyro's noise, together."""
AT_REST = 0.05
"""How near the mean estimate comes to what the design's own gain at rest makes of a step: 3 %, and 2 % that the gyro's
noise leaves in a mean of ten seconds, where it left 0.0006 in twenty of calm air."""
pytestmark = [
    pytest.mark.proof,
    pytest.mark.skipif("DOB_PX4" not in os.environ, reason="no PX4: DOB_PX4 is to be the path of bin/px4 of its build"),
]


def run(module, *arguments, timeout):
    finished = subprocess.run(
        [sys.executable, "-m", f"tests.px4.{module}", *map(str, arguments)],
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
    """What `tests.px4.checks` found in one hover."""
    return json.loads(run("checks", tmp_path_factory.mktemp("hover"), timeout=300).splitlines()[-1])


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    """The design of examples/px4_sih.toml."""
    directory = tmp_path_factory.mktemp("design")
    command = ["design", "examples/px4_sih.toml", "--auto", "-o", directory]
    subprocess.run([sys.executable, "-m", "dob_companion", *map(str, command)], cwd=ROOT, check=True, timeout=900)
    return directory / "design.json"


def test_what_is_added_is_what_the_rate_controller_has_to_take_back(hover):
    assert hover["neutral"]["added"] == 0.0
    assert abs(hover["neutral"]["controller"]) < 0.002
    for stage in ("added", "switched on", "back"):
        assert hover[stage]["added"] == pytest.approx(0.05, abs=1e-6)
        assert hover[stage]["controller"] == pytest.approx(-0.05, abs=0.002)


@pytest.mark.parametrize("stage", ["switched off", "disabled"])
def test_the_pilots_switch_and_the_parameter_take_it_out(hover, stage):
    assert hover[stage]["added"] == 0.0
    assert abs(hover[stage]["controller"]) < 0.002


def test_it_cannot_be_stopped_in_flight(hover):
    assert hover["stopped in flight"] != 0
    assert hover["altitude"] == pytest.approx(10.0, abs=1.0)


def test_in_silence_it_is_gone_within_a_quarter_of_a_second(hover):
    silence = np.array(hover["silence"])
    assert np.all(np.diff(silence[:, 1]) <= 1e-9)
    last = silence[silence[:, 1] > 0.0, 0][-1]
    assert last - silence[0, 0] < 0.25  # 0.1 s held, 0.1 s faded, and what was under way


def test_it_leaves_the_stock_wiring_where_it_is_off_or_does_not_know_the_airframe(hover):
    assert hover["refusals"]["DOBC_EN"].startswith("1 ")
    assert "DOBC_EN is 0, stock wiring" in hover["refusals"]["DOBC_EN"]
    assert "CA_AIRFRAME is not a multirotor, stock wiring" in hover["refusals"]["CA_AIRFRAME"]


def test_it_reports_at_the_full_rate(hover):
    assert hover["neutral"]["rate_hz"] > 240.0
    assert hover["neutral"]["age_us"] <= 8000.0


def test_it_says_why_nothing_is_added(hover):
    assert hover["texts"] == [
        "DOBC: not in hover", "DOBC: ready", "DOBC: off by switch", "DOBC: ready", "DOBC: no companion", "DOBC: ready",
        "DOBC: off by DOBC_EN",
    ]  # fmt: skip


def test_disturbances_are_rejected_in_flight(design, tmp_path):
    run("flights", design, "-o", tmp_path, timeout=1500)
    found = {(row["program"], row["axis"]): row for row in json.loads((tmp_path / "result.json").read_text())}
    at_rest = {block.name: gain_at_rest(block) for block in loads(design.read_text()).blocks}
    for row in filter(lambda row: row["promised"], found.values()):
        calm = found["calm", row["axis"]]["not_done_off"]
        assert row["not_done_on"] < SPARE * np.hypot(row["not_done_off"] / row["promised"], calm), row
    for axis in ("roll", "pitch", "yaw"):
        step = found[f"step-{axis}", axis]
        assert step["estimate_on"] == pytest.approx(step["true"] * at_rest[axis], rel=AT_REST)
    assert not any("RAMP_OUT" in text for row in found.values() for text in row["said"])

"""What an hour of bad luck holds, flown with both autopilots in their own simulators.

Found by DOB_ARDUCOPTER and DOB_PX4, the paths of the programs. Minutes of real time each; `make proof`. What they say
of the daemon is held in simulated time by tests/companion, of the script and the module by
tests/ardupilot/test_script.py and tests/px4/test_core.py.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.simulators.aircraft import AIRCRAFT
from tests.simulators.hardship import CUTS, KILLED, REBOOT

ROOT = Path(__file__).parents[2]
EXAMPLES = {"ardupilot": "examples/ardupilot_copter.toml", "px4": "examples/px4_sih.toml"}
LONGEST_S = 0.2
KEPT = 0.65
"""Share of what the design promises about one axis alone that is to be there with noise about all three."""
ON_THE_WIRE_S = 0.02
"""What a correction and the report of it are under way, and how often it is reported."""

pytestmark = pytest.mark.proof


@pytest.fixture(scope="module", params=AIRCRAFT)
def autopilot(request):
    aircraft = AIRCRAFT[request.param]
    if aircraft.program() is None:
        pytest.skip(f"no {aircraft.name}: {aircraft.variable} is to be the path of its simulator")
    return request.param


@pytest.fixture(scope="module")
def design(autopilot, tmp_path_factory):
    directory = tmp_path_factory.mktemp("design")
    run("dob_companion", "design", EXAMPLES[autopilot], "--auto", "-o", directory, timeout=900)
    return directory / "design.json"


def run(module, *arguments, timeout):
    finished = subprocess.run(
        [sys.executable, "-m", module, *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    assert finished.returncode == 0, finished.stderr


def test_neither_a_killed_daemon_nor_a_cut_nor_a_lost_autopilot_leaves_or_steps_a_correction(
    autopilot, design, tmp_path
):
    run("tests.simulators.hardship", autopilot, design, "-o", tmp_path, timeout=900)
    found = {row["what"]: row for row in json.loads((tmp_path / "result.json").read_text())}
    for name in (KILLED, *CUTS):
        assert found[name]["largest before"] > 0.01
        assert found[name]["zero after s"] <= LONGEST_S + ON_THE_WIRE_S
        assert found[name]["largest rise"] <= 1e-6
    assert found[KILLED]["acting before it is switched on"] == 0.0
    for name in (KILLED, *CUTS, REBOOT):
        assert found[name]["step on return"] <= 1.5 * found[name]["step before"]


def test_ten_minutes_in_noise_about_all_axes_bring_no_fade_for_gaps(autopilot, design, tmp_path):
    run("tests.simulators.endurance", autopilot, design, "-o", tmp_path, timeout=1200)
    result = json.loads((tmp_path / "result.json").read_text())
    assert not any("gap" in why or "rings" in why for why in result["fades"])
    assert result["wrong"] == 0
    for row in result["attitudes"]:
        if "promised" in row:  # PX4, whose truth holds what no observer can change
            assert row["not done off"] > KEPT * row["promised"] * row["not done on"]
        else:
            assert row["rms on"] < 0.2 * row["rms off"]


def test_ten_minutes_of_faults_on_the_wire_bring_no_correction_from_bad_data(autopilot, design, tmp_path):
    run("tests.simulators.endurance", autopilot, design, "-o", tmp_path, "--faults", timeout=1200)
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["wrong"] == 0
    assert all(None not in times for times in result["recoveries"].values())
    for row in result["attitudes"]:
        assert row["rms on"] < row["rms off"]

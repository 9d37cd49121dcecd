"""A design and a short flight, for every test of campaigns."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from dob_companion.artifact import dumps
from dob_companion.synthesis import design_from_toml
from tests.shared import built_once
from tests.sitl.campaign.processes import arguments, run

SHORT = """
title = "Short"
hover_altitude_m = 1.0
[gyro]
noise_dbw = -68.0
[disturbance]
bandwidth_hz = 1.0
peak_attitude_error_rad = { roll = 0.03, pitch = 0.04, yaw = 0.04 }
[windows]
lead_s = 0.2
length_s = 1.5
settle_s = 1.0
"""


@pytest.fixture(scope="session")
def design(tmp_path_factory) -> Path:
    spec = Path(__file__).parents[3] / "examples" / "tailsitter_paper.toml"

    def build(directory: Path) -> None:
        design = design_from_toml(spec.read_text("utf-8"), str(spec), "2026-01-01T00:00:00Z")
        (directory / "paper.json").write_text(dumps(design)[0])

    return built_once(tmp_path_factory, "campaign-design", build) / "paper.json"


@pytest.fixture(scope="session")
def short(tmp_path_factory) -> Path:
    """A scenario of some nine seconds, climb included."""
    path = tmp_path_factory.mktemp("scenario") / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="session")
def flown(design, short, tmp_path_factory):
    """Directory, summary and rows of a campaign that nobody disturbed."""

    def build(directory: Path) -> None:
        finished = run(arguments(design, short, directory / "dir", "--processes", 2, "--json"))
        assert finished.returncode == 0, finished.stderr
        (directory / "summary.json").write_text(finished.stdout)

    there = built_once(tmp_path_factory, "campaign", build)
    out = there / "dir"
    return out, json.loads((there / "summary.json").read_text()), pq.read_table(out / "flights.parquet").to_pylist()

"""A design and a short flight, for every test of campaigns."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from dob_companion.artifact import dumps
from dob_companion.synthesis import design_from_toml
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
    path = tmp_path_factory.mktemp("design") / "paper.json"
    path.write_text(dumps(design_from_toml(spec.read_text("utf-8"), str(spec), "2026-01-01T00:00:00Z"))[0])
    return path


@pytest.fixture(scope="session")
def short(tmp_path_factory) -> Path:
    """A scenario of some nine seconds, climb included."""
    path = tmp_path_factory.mktemp("scenario") / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="session")
def flown(design, short, tmp_path_factory):
    """Directory, summary and rows of a campaign that nobody disturbed."""
    out = tmp_path_factory.mktemp("campaign") / "dir"
    finished = run(arguments(design, short, out, "--processes", 2, "--json"))
    assert finished.returncode == 0, finished.stderr
    return out, json.loads(finished.stdout), pq.read_table(out / "flights.parquet").to_pylist()

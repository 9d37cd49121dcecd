"""A tail-sitter whose IMU is mounted as in forward flight, as processes: flown by the right map, not by none."""

import numpy as np
import pytest

from dob_companion.logs import read_log
from dob_companion.mavlink.axes import VehicleAxes, axis_map
from tests.cli.processes import run_cli
from tests.scenarios.designs import design_file
from tests.scenarios.wire import fly
from tests.sitl.bench import SHORT

LONGER = SHORT.replace("lead_s = 0.2", "lead_s = 1.0").replace("length_s = 1.0", "length_s = 2.0")
GYRO = ["yaw", "pitch", "-roll"]


def flown(directory, configuration, text=LONGER, clock="lockstep"):
    scenario, config, flights = directory / "short.toml", directory / "c.toml", directory / "flights"
    scenario.write_text(text)
    config.write_text(configuration)
    vehicle = ("--imu", "forward-flight", "--clock", clock)
    options = ("--config", str(config), "--record", str(flights))
    design = design_file(directory, 1)
    ended = fly(str(scenario), design, 1, directory / "out", vehicle=vehicle, companion=options)
    return ended, directory


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    return flown(tmp_path_factory.mktemp("right"), f"[axes]\ngyro = {GYRO}")


def test_with_the_right_map_it_is_enabled_and_attenuates_on_all_axes(right):
    ended, _ = right
    assert all(axis["rms_off"] > 2.0 * axis["rms_on"] for axis in ended.result["axes"].values()), ended.result["axes"]


def test_its_recording_is_replayed_and_read_in_hovers_axes(right, tmp_path):
    _, directory = right
    flights = directory / "flights"
    assert run_cli("replay", flights).returncode == 0
    assert run_cli("report", flights, "-o", tmp_path / "page.html").returncode == 0
    (ours,) = read_log(flights)
    (tlog,) = flights.glob("*.tlog")
    (as_sent,), (turned,) = read_log(tlog), read_log(tlog, VehicleAxes(axis_map(GYRO)))
    assert np.array_equal(ours.rates.values, turned.rates.values)
    assert np.array_equal(turned.rates.values, as_sent.rates.values @ [[0, 0, -1], [0, 1, 0], [1, 0, 0]])
    gyro = np.load(directory / "out" / "flight.npz")["gyro"].astype(np.float32)
    assert (turned.rates.values[-500:, None] == gyro[-1000:]).all(axis=2).any(axis=1).all()


def test_without_a_map_nothing_is_injected_and_the_reason_is_said(tmp_path):
    # In real time, because a reason is said when it has stood for three seconds of an operator's time.
    _, directory = flown(tmp_path, "", SHORT.replace("length_s = 1.0", "length_s = 6.0"), clock="real-time")
    assert not np.load(directory / "out" / "flight.npz")["correction"].any()
    (tlog,) = (directory / "flights").glob("*.tlog")
    assert b"is swapped with yaw" in tlog.read_bytes()

"""A flight in one process against the same flight over the wire: real processes, UDP, MAVLink."""

import json
import select
import subprocess
import sys
from time import monotonic

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl.calibration import disturbance_scale
from sitl.campaign.pilot import Job, fly
from sitl.campaign.plan import Inputs
from sitl.result import summarize
from sitl.scenario.spec import load
from tests.cli.processes import daemon
from tests.ports import free_port
from tests.sitl.bench import Peer

EVENTFUL = """
[[event]]
kind = "gyro_bias"
at_s = 0.3
rad_s = { pitch = 0.01 }

[[event]]
kind = "link"
at_s = 0.5
answers_lost = 0.1
pairs_lost = 0.02
jitter_samples = 2

[clock]
grid_us = 2500
jitter_us = 50
skew_ppm = 4000
"""


@pytest.mark.parametrize(("delay", "events"), [(1, ""), (2, EVENTFUL)], ids=["clean link", "bad link"])
def test_a_wire_flight_gives_the_same_numbers_to_the_last_bit(design, short, tmp_path, delay, events):
    """Every sample of every array in float64: settling, switch, ramp, corrections, their ages, the daemon's states."""
    path = tmp_path / "flown.toml"
    path.write_text(short.read_text() + events)
    over_the_wire(design, path, 3, delay, tmp_path)
    scenario = load(str(path))
    inputs = Inputs(0, 3, "linear", "paper", delay, 1.0, 1.0)
    craft = fly(Job(inputs, scenario, disturbance_scale(scenario, 3), design.read_text(), {}))
    assert not craft.failure
    arrays = craft.flight.log.arrays()
    with np.load(tmp_path / "flight.npz") as wire:
        assert set(wire.files) == set(arrays)
        for name in wire.files:
            assert wire[name].dtype == arrays[name].dtype
            assert wire[name].tobytes() == arrays[name].tobytes(), name
        assert np.any(wire["correction"][wire["window"] == 2])
        assert wire["answered"].all() == (not events)
    result = json.loads((tmp_path / "result.json").read_text())
    assert result == summarize(scenario, 3, "in-process", arrays) | {"clock": "lockstep", "checks": []}


def over_the_wire(design, scenario, seed, delay, out):
    port, station = free_port(), Peer(255, 190)
    command = [sys.executable, "-m", "sitl", scenario, "--clock", "lockstep", "--seed", str(seed), "-o", out]
    command += ["--delay", str(delay), "--no-figure"]
    command += ["--link", f"udpout:127.0.0.1:{port}", "--gcs", station.url]
    with daemon(design, port), subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as vehicle:
        try:
            deadline = monotonic() + 60.0
            while vehicle.poll() is None:
                assert monotonic() < deadline
                ready, _, _ = select.select([station.socket], [], [], 0.1)
                for message in station.receive() if ready else ():
                    if message.get_type() == "STATUSTEXT" and message.text == "sitl: waiting for DOB_ENABLE=1":
                        station.send(mavlink.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9))
            assert vehicle.returncode == 0, vehicle.stderr.read()
        finally:
            vehicle.kill()
    station.socket.close()

"""Clients that others wrote, on an autopilot of either make: they list, read and toggle the companion's parameters."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from dob_companion.companion import PARAMETERS
from tests.cli.processes import PATIENCE_S
from tests.clients.processes import ROOT, MavProxy, flying
from tests.ports import free_port
from tests.recorder.flights import wait_until

KINDS = ("px4", "ardupilot")
NAMES = [spec.name for spec in PARAMETERS]


@pytest.mark.parametrize("kind", KINDS)
def test_mavsdk_lists_reads_and_toggles(design, kind):
    with flying(design, kind) as ground:
        finished = subprocess.run(
            [sys.executable, "-m", "tests.clients.station", f"udpin://127.0.0.1:{ground}"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    assert finished.returncode == 0, finished.stderr
    found = json.loads(finished.stdout.splitlines()[-1])
    assert sorted(found["floats"]) == sorted(NAMES)
    assert found["others"] == []  # every one is REAL32, whatever the autopilot's own encoding is
    assert found["limit"] == pytest.approx(0.3)
    assert (found["after float 1"], found["after float 0"]) == (1.0, 0.0)
    # MAVSDK knows our type and complains of an integer write. On PX4 it has sent the four bytes of an int32 by then,
    # which are understood; on ArduPilot it asks first and then sends nothing.
    assert found["integers"] == "WRONG_TYPE"
    assert (found["after int 1"], found["after int 0"]) == (1.0 if kind == "px4" else 0.0, 0.0)
    refused = {"DOB_NOPE": "DOES_NOT_EXIST", "DOB_STATE": "READ_ONLY", "DOB_GAIN": "VALUE_OUT_OF_RANGE"}
    assert {name: found[name] for name in refused} == refused
    assert found["state"] == 0.0


@pytest.mark.parametrize("kind", [KINDS[0], *(pytest.param(kind, marks=pytest.mark.proof) for kind in KINDS[1:])])
def test_mavproxy_lists_reads_and_toggles(design, kind, tmp_path):
    with flying(design, kind) as ground, MavProxy(f"udpin:127.0.0.1:{ground}", tmp_path) as console:
        console.wait_for("online system 1")
        console.ask("vehicle 1:191", f"Received {len(NAMES)} parameters")
        shown = [console.ask(f"param show {name}", name).split()[-2:] for name in NAMES]
        assert [name for name, _ in shown] == NAMES
        assert float(dict(shown)["DOB_LIMIT"]) == pytest.approx(0.3)
        for wish, heard in ((1, "DOB WAITING: switched on"), (0, "DOB DISABLED: switched off")):
            console.ask(f"param set DOB_ENABLE {wish}", heard)
            console.ask("param fetch DOB_ENABLE", f"DOB_ENABLE = {wish}.0")
        console.type("param set DOB_STATE 3")
        console.type("param set DOB_GAIN 9")
        console.wait_for("Failed to set DOB_STATE")
        console.wait_for("Failed to set DOB_GAIN")


def test_ctrl_c_while_mavsdk_looks_for_a_vehicle_ends_at_once_and_in_order():
    port = free_port()
    command = [sys.executable, "-m", "dob_companion", "status", "--link", f"udpin:127.0.0.1:{port}", "--timeout", "60"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        wait_until(lambda: f":{port:04X} " in Path("/proc/net/udp").read_text())  # it listens
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, errors) == (130, "")

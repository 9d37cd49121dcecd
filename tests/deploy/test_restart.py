"""The daemon as systemd runs it: ready, alive, killed, started again."""

import signal
import socket
import time

import pytest

from dob_companion.artifact import dumps
from dob_companion.companion.kept_parameters import load_parameters
from tests.cli.processes import PATIENCE_S, UdpVehicle, daemon, wait_for
from tests.companion.aircraft import small_design
from tests.ports import free_port


@pytest.fixture
def design(tmp_path):
    path = tmp_path / "design.json"
    path.write_text(dumps(small_design())[0])
    return path


@pytest.fixture
def manager(tmp_path, monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        ear.bind(str(tmp_path / "notify"))
        ear.settimeout(PATIENCE_S)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "400000")
        yield ear


def read(vehicle, name):
    return vehicle.write(name, float("nan")).param_value  # refused, and echoed as it stands


def once(fits):
    """Wait until it fits; the file appears a moment after the echo, because the loop does not wait for disks."""
    deadline = time.monotonic() + PATIENCE_S
    while not fits():
        assert time.monotonic() < deadline
    return True


def test_systemd_hears_ready_then_signs_of_life_from_the_loop_then_stopping(design, manager):
    with daemon(design, free_port()) as process:
        assert manager.recv(4096).startswith(b"READY=1\nWATCHDOG=1\nSTATUS=DISABLED")
        for _ in range(3):
            assert manager.recv(4096).startswith(b"WATCHDOG=1\n")
        process.send_signal(signal.SIGTERM)
        last = b""
        while not last.startswith(b"STOPPING=1"):
            last = manager.recv(4096)
        assert process.wait(PATIENCE_S) == 0


def test_what_the_operator_set_survives_kill_9_and_enable_does_not(design, tmp_path):
    state = tmp_path / "state"
    port = free_port()
    with daemon(design, port, "--state", state) as process, UdpVehicle(port) as vehicle:
        vehicle.fly(2)
        vehicle.write("DOB_ENABLE", 1.0)
        vehicle.write("DOB_LIMIT", 0.125)
        file = state / "parameters.json"
        once(lambda: file.exists() and load_parameters(file.read_text(), "") == {"DOB_LIMIT": 0.125})
        process.kill()
    with daemon(design, port, "--state", state), UdpVehicle(port) as vehicle:
        vehicle.fly(2)
        assert read(vehicle, "DOB_LIMIT") == 0.125
        assert read(vehicle, "DOB_ENABLE") == 0.0


def test_the_operators_setting_stands_above_the_configured_one(design, tmp_path):
    config = tmp_path / "config.toml"
    config.write_text(f'state_directory = "{tmp_path}/state"\n[parameters]\nDOB_GAIN = 0.5\nDOB_LIMIT = 0.5\n')
    port = free_port()
    for limit in (0.5, 0.25):
        with daemon(design, port, "--config", config), UdpVehicle(port) as vehicle:
            vehicle.fly(2)
            assert (read(vehicle, "DOB_GAIN"), read(vehicle, "DOB_LIMIT")) == (0.5, limit)
            vehicle.write("DOB_LIMIT", 0.25)
            once((tmp_path / "state" / "parameters.json").exists)


def test_a_torn_state_file_does_not_keep_the_daemon_from_flying(design, tmp_path):
    (tmp_path / "parameters.json").write_text("{")
    port = free_port()
    with daemon(design, port, "--state", tmp_path) as process, UdpVehicle(port) as vehicle:
        vehicle.fly(2)
        assert read(vehicle, "DOB_LIMIT") == pytest.approx(0.3)
        process.send_signal(signal.SIGTERM)
        wait_for(process.stderr, "stopped")
    assert (tmp_path / "parameters.json.damaged").read_text() == "{"

"""The daemon on a link that stands still, and under more than it can take: its loop goes on turning."""

import contextlib
import os
import select
import shutil
import signal
import subprocess
import sys
import threading

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.artifact import dumps
from tests.cli.processes import PATIENCE_S, UdpVehicle, daemon, wait_for
from tests.companion.aircraft import small_design
from tests.ports import free_port
from tests.runtime.messages import Ear

SAMPLES = 3_000
"""Answers of 40 bytes: more than a pseudo-terminal keeps."""


@pytest.fixture
def design(tmp_path):
    path = tmp_path / "design.json"
    path.write_text(dumps(small_design())[0])
    return path


@contextlib.contextmanager
def serial_daemon(design, baud):
    """A daemon on a pseudo-terminal; yields it and the far end."""
    master, slave = os.openpty()
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "dob_companion",
            "run",
            "--design",
            design,
            "--link",
            f"serial:{os.ttyname(slave)}:{baud}",
        ],
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_for(process.stderr, "listening")
        yield process, master
    finally:
        process.kill()
        process.communicate()
        os.close(master)
        os.close(slave)


def test_a_serial_line_that_nobody_reads_neither_holds_the_loop_nor_gets_parts_of_messages(design):
    out = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    with serial_daemon(design, 57600) as (process, master):
        os.write(master, mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3).pack(out))
        for k in range(SAMPLES):
            stamp = 1_000_000 + 4000 * k
            for message in (
                mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, 0.1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 56),
                mav.MAVLink_actuator_control_target_message(stamp, 0, [0, 0, 0, 0.5, 0, 0, 0, 1]),
            ):
                write_whole(master, message.pack(out))
        process.terminate()
        ear = Ear()
        with contextlib.suppress(OSError):
            while process.poll() is None or select.select([master], [], [], 0.1)[0]:
                if select.select([master], [], [], 0.1)[0]:
                    ear.hear(os.read(master, 4096))
        assert process.wait(PATIENCE_S) == 0
        assert 0 < len(ear.stamps) < SAMPLES
        assert ear.stamps == sorted(ear.stamps)


def write_whole(fd, data):
    while data:
        data = data[os.write(fd, data) :]


def flood(port, stop):
    """As many datagrams as there can be."""
    with UdpVehicle(port) as stranger:
        while not stop.is_set():
            with contextlib.suppress(OSError):
                stranger.socket.send(b"\xfd" * 200)


@pytest.mark.skipif(os.geteuid() != 0, reason="real-time priority is not granted here")
def test_under_a_flood_the_daemon_gives_up_real_time_says_so_and_still_leaves_when_told(design):
    port, stop = free_port(), threading.Event()
    flooding = threading.Thread(target=flood, args=(port, stop))
    with daemon(design, port) as process:
        flooding.start()
        try:
            wait_for(process.stderr, "real-time scheduling given up")
            assert os.sched_getscheduler(process.pid) == os.SCHED_OTHER
            process.send_signal(signal.SIGTERM)
            assert process.wait(PATIENCE_S) == 0
        finally:
            stop.set()
            flooding.join()


def test_a_server_that_does_not_answer_keeps_nobody_from_leaving(design):
    process = subprocess.Popen(
        [sys.executable, "-m", "dob_companion", "run", "--design", design, "--link", "tcp:127.0.0.1:9"],
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for(process.stderr, "Connection refused; trying again every second")
    process.terminate()
    assert process.wait(PATIENCE_S) == 0
    process.communicate()


def test_a_disk_that_is_gone_costs_what_would_be_kept_and_recorded_and_never_the_flight(design, tmp_path):
    port, disk = free_port(), tmp_path / "disk"
    with (
        daemon(design, port, "--state", disk / "state", "--record", disk / "flights") as process,
        UdpVehicle(port) as vehicle,
    ):
        vehicle.activate()
        shutil.rmtree(disk)
        vehicle.write("DOB_LIMIT", 0.25)
        wait_for(process.stderr, "it will be missed after a restart")
        assert vehicle.fly(50)[-1].x == pytest.approx(-0.2, abs=1e-3)
        process.terminate()
        assert vehicle.last_correction(process).x == 0.0
        assert process.returncode == 0

"""`dob-companion spec` as a process: over a socket from an autopilot that is asked by name; from files."""

import contextlib
import re
import select
import socket
import struct
import subprocess
import sys
import threading
import time
import tomllib
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.autopilots import parse_parameters
from tests.cli.processes import PATIENCE_S, one_line, run_cli
from tests.ports import free_port

DATA = Path(__file__).parents[1] / "data" / "parameters"


class Autopilot:
    """Beats, acknowledges, answers TIMESYNC and PARAM_REQUEST_READ; the first request for a roll gain is lost."""

    def __init__(self, port, make, file, whole=(), key=b""):
        self.values = parse_parameters((DATA / file).read_text(encoding="utf-8"), file).values
        self.make, self.whole, self.lost, self.written = make, whole, set(), []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.out, self.ear = mav.MAVLink(None, srcSystem=1, srcComponent=1), mav.MAVLink(None)
        self.ear.robust_parsing = True
        self.refused = 0
        if key:
            self.out.signing.secret_key, self.out.signing.sign_outgoing = key, True
            self.out.signing.link_id, self.out.signing.timestamp = 1, int((time.time() - 1420070400) * 1e5)
            self.ear.signing.secret_key, self.ear.signing.allow_unsigned_callback = key, self.refuse
        self.over = threading.Event()

    def refuse(self, *_):
        self.refused += 1
        return False

    def send(self, message):
        with contextlib.suppress(ConnectionRefusedError):
            self.socket.send(bytes(message.pack(self.out)))

    def serve(self):
        while not self.over.is_set():
            self.send(mav.MAVLink_heartbeat_message(2, self.make, 0, 0, 3, 3))
            while select.select([self.socket], [], [], 0.2)[0]:
                with contextlib.suppress(ConnectionRefusedError):
                    for message in self.ear.parse_buffer(self.socket.recv(4096)) or []:
                        self.answer(message)

    def answer(self, message):
        kind = message.get_type()
        if kind == "COMMAND_LONG" and message.command == mav.MAV_CMD_REQUEST_MESSAGE:
            self.send(mav.MAVLink_autopilot_version_message(0, 0x040700FF, 0, 0, 0, *[[0] * 8] * 3, 0, 0, 0))
        if kind == "COMMAND_LONG":
            self.send(mav.MAVLink_command_ack_message(message.command, 0, 0, 0, 1, 191))
        if kind == "TIMESYNC" and message.tc1 == 0:
            self.send(mav.MAVLink_timesync_message(5, message.ts1))
        if kind == "PARAM_SET":
            self.written.append(message)
        if kind == "PARAM_REQUEST_READ" and message.param_id in self.values:
            self.tell(message.param_id)

    def tell(self, name):
        if ("ROLL" in name or "RLL" in name) and name not in self.lost:
            self.lost.add(name)
            return
        value = self.values[name]
        if name in self.whole:
            (value,) = struct.unpack("<f", struct.pack("<i", int(value)))
        kind = mav.MAV_PARAM_TYPE_INT32 if name in self.whole else mav.MAV_PARAM_TYPE_REAL32
        self.send(mav.MAVLink_param_value_message(name.encode(), value, kind, 1000, 5))


@contextlib.contextmanager
def autopilot(*what, **more):
    port = free_port()
    vehicle = Autopilot(port, *what, **more)
    thread = threading.Thread(target=vehicle.serve)
    thread.start()
    try:
        yield vehicle, f"udpin:127.0.0.1:{port}"
    finally:
        vehicle.over.set()
        thread.join(PATIENCE_S)
        vehicle.socket.close()


def tables(text):
    spec = tomllib.loads(text)
    return spec["block"], spec["auto"]["attitude_gain"]


@pytest.mark.parametrize(
    ("make", "file", "whole", "version"),
    [
        (mav.MAV_AUTOPILOT_ARDUPILOTMEGA, "copter.param", (), "ArduPilot 4.7.0"),
        (mav.MAV_AUTOPILOT_PX4, "quad.params", ("IMU_INTEG_RATE", "IMU_GYRO_RATEMAX", "MC_BAT_SCALE_EN"), "PX4 4.7.0"),
    ],
)
def test_a_link_gives_the_spec_that_the_file_gives_and_writes_nothing(make, file, whole, version, tmp_path):
    with autopilot(make, file, whole=whole) as (vehicle, url):
        told = run_cli("spec", "--link", url, "--gain", "300,yaw=14", "-o", tmp_path / "told.toml")
    read = run_cli("spec", "--params", DATA / file, "--gain", "300,yaw=14")
    assert (told.returncode, read.returncode) == (0, 0), told.stderr + read.stderr
    text = (tmp_path / "told.toml").read_text(encoding="utf-8")
    assert tables(text) == tables(read.stdout)
    assert f"parameters: {version} on {url}" in text
    assert re.search(r"^delay_samples = \d+   # TIMESYNC round trip [\d.]+ ms at 95 %", text, re.MULTILINE)
    assert vehicle.written == []


KEY = bytes(range(32))


@pytest.mark.parametrize("key", [KEY, bytes(32)], ids=["ours", "another's"])
def test_with_a_key_it_signs_what_it_asks_and_takes_nothing_that_is_not_signed_with_it(key, tmp_path):
    secret, config = tmp_path / "signing.key", tmp_path / "c.toml"
    secret.write_text(KEY.hex() + "\n")
    secret.chmod(0o600)
    config.write_text(f'signing_key_file = "{secret}"\n')
    with autopilot(mav.MAV_AUTOPILOT_ARDUPILOTMEGA, "copter.param", key=key) as (vehicle, url):
        told = run_cli("spec", "--link", url, "--config", config, "--state", tmp_path / "state", "--gain", "300,yaw=14")
    assert (told.returncode == 0) == (key == KEY), told.stderr
    assert ("parameters: ArduPilot" in told.stdout) == (key == KEY)
    assert (vehicle.refused == 0) == (key == KEY)


def test_nobody_on_the_link_is_one_line_with_what_would_tell_more():
    finished = run_cli("spec", "--link", f"udpin:127.0.0.1:{free_port()}")
    assert finished.returncode == 1
    assert "dob-companion doctor --link" in one_line(finished)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--params", "nowhere.param"), "nowhere.param: cannot be read"),
        (("--params", DATA / "copter.param", "--gain", "yaw=0"), "--gain yaw: 0, expected a number that is not 0"),
        (("--params", DATA / "copter.param", "--delay-ms", "-1"), "--delay-ms of all axes: -1"),
    ],
)
def test_what_cannot_begin_is_one_line(arguments, words):
    finished = run_cli("spec", *arguments)
    assert finished.returncode == 2
    assert words in one_line(finished)


def test_an_axis_that_does_not_exist_is_a_usage_error():
    command = [sys.executable, "-m", "dob_companion", "spec", "--params", "x", "--gain", "role=3"]
    finished = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (finished.returncode, "roll, pitch, yaw" in finished.stderr) == (2, True)


def test_axes_without_a_gain_are_named():
    finished = run_cli("spec", "--params", DATA / "copter.param", "--gain", "roll=306", "--delay", "3")
    assert "no gain of pitch, yaw yet" in one_line(finished)
    assert "delay_samples = 3   # given" in finished.stdout

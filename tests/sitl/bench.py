"""The other end of both links, for tests: a companion that answers with zeros and a ground station, on real sockets."""

import os
import select
import socket
import subprocess
import sys
from pathlib import Path
from time import monotonic
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from tests.cli.processes import PATIENCE_S

SHORT = """
title = "short"
hover_altitude_m = 1.0
[gyro]
noise_dbw = -68.0
[disturbance]
bandwidth_hz = 1.0
peak_attitude_error_rad = { roll = 0.15, pitch = 0.12, yaw = 0.12 }
[windows]
lead_s = 0.2
length_s = 1.0
settle_s = 0.2
[paper_ratio]
roll = 7.5
pitch = 12.0
yaw = 6.0
"""


def short_scenario(directory: Path) -> str:
    path = directory / "short.toml"
    path.write_text(SHORT)
    return str(path)


def parser_of() -> Any:
    mav = mavlink.MAVLink(None, 0, 0)
    mav.robust_parsing = True
    return mav


def payload(message: Any) -> bytes:
    return bytes(message._msgbuf[10:-2])


class Peer:
    """One end of a link: a bound UDP socket, a MAVLink identity, and what it heard."""

    def __init__(self, system: int, component: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.vehicle: Any = None
        self._in, self._out = parser_of(), mavlink.MAVLink(None, system, component)

    @property
    def url(self) -> str:
        return f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"

    def receive(self) -> list[Any]:
        data, self.vehicle = self.socket.recvfrom(65536)
        return self._in.parse_buffer(data) or []

    def send(self, message: Any) -> None:
        if self.vehicle:
            self.socket.sendto(message.pack(self._out), self.vehicle)


class Sitl:
    """A simulated vehicle as a process, with both peers served by `run`."""

    def __init__(self, *arguments: str) -> None:
        self.companion, self.ground = Peer(1, 191), Peer(255, 190)
        self.pairs: list[bytes] = []
        self.texts: list[str] = []
        self.answering = self.obeying = True
        self.enable = 0.0
        self.at_ground: list[Any] = []
        root = Path(__file__).parents[2]
        links = ("--link", self.companion.url, "--gcs", self.ground.url)
        self.process = subprocess.Popen(
            [sys.executable, "-m", "sitl", *arguments, *links],
            cwd=root,
            env={**os.environ, "PYTHONPATH": str(root)},
            stderr=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> "Sitl":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()
        self.companion.socket.close()
        self.ground.socket.close()

    def run(self, until: Any = lambda: False, limit: float = 60.0) -> None:
        """Serve both links until `until()` holds or the process has ended."""
        deadline = monotonic() + limit
        while not until() and self.process.poll() is None:
            assert monotonic() < deadline, (self.texts, len(self.pairs))
            ready, _, _ = select.select([self.companion.socket, self.ground.socket], [], [], 0.1)
            if self.companion.socket in ready:
                self._companion()
            if self.ground.socket in ready:
                self._ground()

    def finish(self) -> tuple[int, str]:
        """Serve to the end; exit code and stderr."""
        self.run()
        _, err = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, err

    def _companion(self) -> None:
        for message in self.companion.receive():
            kind = message.get_type()
            if kind in ("HIGHRES_IMU", "ACTUATOR_CONTROL_TARGET"):
                self.pairs.append(payload(message))
            if kind == "HIGHRES_IMU" and self.answering:
                self.companion.send(mavlink.MAVLink_debug_vect_message(b"DOB_CORR", message.time_usec, 0.0, 0.0, 0.0))
            if kind == "PARAM_SET":
                self.enable = message.param_value
                self.report_enable(message.param_value)

    def report_enable(self, value: float) -> None:
        self.companion.send(mavlink.MAVLink_param_value_message(b"DOB_ENABLE", value, 9, 6, 0))

    def _ground(self) -> None:
        for message in self.ground.receive():
            self.at_ground.append(message)
            if message.get_type() == "STATUSTEXT":
                self.texts.append(message.text)
                if self.obeying:
                    self._obey(message.text)

    def _obey(self, text: str) -> None:
        if text == "sitl: waiting for DOB_ENABLE=1":
            self.ground.send(mavlink.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9))
        elif text == "sitl: waiting for arm":
            self.ground.send(command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0))
        elif text == "sitl: waiting for takeoff":
            self.ground.send(command(mavlink.MAV_CMD_NAV_TAKEOFF))


def command(number: int, p1: float = 0.0, p2: float = 0.0, p7: float = 0.0, target: tuple[int, int] = (1, 1)) -> Any:
    return mavlink.MAVLink_command_long_message(*target, number, 0, p1, p2, 0.0, 0.0, 0.0, 0.0, p7)

"""Several programs on one port of the autopilot: a router between vehicle, companion and ground station.

mavlink-router where it is installed (not every distribution has a package), and a real MAVProxy with --out everywhere.
"""

import configparser
import json
import shutil
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.artifact import dumps
from tests.cli.processes import PATIENCE_S
from tests.clients.processes import ROOT, MavProxy, process
from tests.companion.aircraft import small_design
from tests.ports import free_port
from tests.scenarios.designs import design_for

CONFIG = ROOT / "deploy" / "mavlink-router.conf"


class Ground:
    """A ground station on a socket: a heartbeat, parameter writes, and everything it hears by sender and name."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.socket.settimeout(0.1)
        self.mav = mav.MAVLink(None, srcSystem=255, srcComponent=190)
        self.mav.robust_parsing = True
        self.peer = None
        self.heard = {}
        self.beat_at = 0.0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, message):
        if self.peer is not None:
            self.socket.sendto(message.pack(self.mav), self.peer)

    def until(self, met):
        """Listen, with a heartbeat each second, until it is met."""
        deadline = time.monotonic() + PATIENCE_S
        while not met():
            assert time.monotonic() < deadline, sorted(self.heard)
            if time.monotonic() >= self.beat_at:
                self.beat_at = time.monotonic() + 1.0
                self.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            try:
                data, self.peer = self.socket.recvfrom(65536)
            except TimeoutError:
                continue
            for message in self.mav.parse_buffer(data) or []:
                name = message.get_type()
                key = message.param_id if name == "PARAM_VALUE" else name
                self.heard[message.get_srcComponent(), key] = message

    def write(self, name, value):
        self.heard.pop((191, name), None)

        def echoed():
            if (191, name) in self.heard:
                return True
            self.send(mav.MAVLink_param_set_message(1, 191, name.encode(), value, 9))
            return False

        self.until(echoed)
        assert self.heard[191, name].param_value == value


class Companion:
    """`run --json` as a process; its newest status."""

    def __init__(self, port, directory, clock):
        """In lockstep the vehicle's own observer; in real time one that bears a router's delay."""
        design = directory / "design.json"
        small = small_design(delay_samples=5, delay_margin=30)
        design.write_text(dumps(design_for(1) if clock == "lockstep" else small)[0])
        command = ["run", "--design", design, "--link", f"udpin:127.0.0.1:{port}", "--json"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "dob_companion", *command], cwd=ROOT, stdout=subprocess.PIPE, text=True
        )
        self.status, self.events = {"state": None}, []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            said = json.loads(line)
            self.status = said.get("status", self.status)
            self.events.append(said.get("event"))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(PATIENCE_S)


@pytest.fixture
def ports():
    return {name: free_port() for name in ("router", "companion", "ground", "radio")}


@pytest.fixture
def clock():
    """In lockstep a router may take as long as a busy machine lets it."""
    return "lockstep"


@pytest.fixture
def vehicle(ports, clock):
    """In hover: one link to the router, and a radio of its own."""
    links = ("--link", f"udpout:127.0.0.1:{ports['router']}", "--gcs", f"udpout:127.0.0.1:{ports['radio']}")
    with process("-m", "sitl", "calm", "--clock", clock, *links, stderr=subprocess.DEVNULL):
        yield


def activate(ground, companion):
    """Switch on, with a gain of zero: the design may not be this vehicle's. ACTIVE proves rate and delay."""
    ground.write("DOB_GAIN", 0.0)
    ground.write("DOB_ENABLE", 1.0)
    ground.until(lambda: companion.status["state"] == "ACTIVE")
    assert companion.status["rate_hz"] >= 0.9 * 250.0


def routed(ports, directory):
    """deploy/mavlink-router.conf with this test's addresses, and UDP in the place of the serial line."""
    config = configparser.ConfigParser()
    config.optionxform = str
    config.read(CONFIG)
    config.remove_section("UartEndpoint autopilot")
    config["UdpEndpoint autopilot"] = {"Mode": "Server", "Address": "127.0.0.1", "Port": str(ports["router"])}
    for name in ("companion", "ground"):
        config[f"UdpEndpoint {name}"].update({"Address": "127.0.0.1", "Port": str(ports[name])})
    path = directory / "main.conf"
    with path.open("w") as file:
        config.write(file)
    return path


@pytest.mark.skipif(not shutil.which("mavlink-routerd"), reason="mavlink-routerd is not installed")
def test_through_mavlink_router_the_companion_flies_and_the_ground_hears_what_it_should(
    ports, vehicle, clock, tmp_path
):
    router = subprocess.Popen(["mavlink-routerd", "-c", routed(ports, tmp_path)], stderr=subprocess.DEVNULL)
    try:
        with Companion(ports["companion"], tmp_path, clock) as companion, Ground(ports["ground"]) as ground:
            ground.until(lambda: {(1, "HEARTBEAT"), (191, "HEARTBEAT")} <= ground.heard.keys())
            activate(ground, companion)
            ground.until(lambda: (191, "DEBUG_FLOAT_ARRAY") in ground.heard)
            kept = {"HIGHRES_IMU", "ACTUATOR_CONTROL_TARGET", "DEBUG_VECT", "SET_ACTUATOR_CONTROL_TARGET"}
            assert not kept & {name for _, name in ground.heard}
    finally:
        router.terminate()
        router.wait(PATIENCE_S)


@pytest.mark.parametrize("clock", ["lockstep", pytest.param("real-time", marks=pytest.mark.proof)])
def test_through_mavproxy_the_companion_flies_and_the_ground_sees_the_vehicle(ports, vehicle, clock, tmp_path):
    outputs = [f"--out=127.0.0.1:{ports[name]}" for name in ("companion", "ground")]
    with (
        MavProxy(f"udpin:127.0.0.1:{ports['router']}", tmp_path, *outputs, "--streamrate=-1") as _,
        Companion(ports["companion"], tmp_path, clock) as companion,
        Ground(ports["ground"]) as ground,
        Ground(ports["radio"]) as radio,
    ):
        ground.until(lambda: (1, "HEARTBEAT") in ground.heard)
        radio.until(lambda: (191, "HEARTBEAT") in radio.heard)  # routed by the vehicle, as docs/links.md says
        activate(radio, companion)
        ground.until(lambda: (1, "HIGHRES_IMU") in ground.heard)
        assert (191, "HEARTBEAT") not in ground.heard  # one --out does not hear another


def test_the_configuration_names_the_companions_default_port():
    config = configparser.ConfigParser()
    config.read(CONFIG)
    assert config["UdpEndpoint companion"]["Port"] in (Path(ROOT) / "deploy" / "dob-companion.default").read_text()

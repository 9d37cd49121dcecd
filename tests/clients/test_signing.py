"""The daemon with a signing key, and peers that have it, have another, or have none."""

import hashlib
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.files.timestamp import AHEAD
from dob_companion.mavlink.signing import ticks
from tests.cli.processes import UdpVehicle, daemon, run_cli
from tests.clients.processes import MavProxy, flying, process
from tests.ports import free_port

PASSPHRASE = "hover"
KEY = hashlib.sha256(PASSPHRASE.encode()).digest()


@pytest.fixture
def config(tmp_path):
    key = tmp_path / "signing.key"
    key.write_text(KEY.hex() + "\n")
    key.chmod(0o600)
    path = tmp_path / "config.toml"
    path.write_text(f'signing_key_file = "{key}"\nstate_directory = "{tmp_path}/state"\n')
    return path


def sign(peer, key=KEY, timestamp=None):
    peer.signing.secret_key, peer.signing.sign_outgoing = key, True
    peer.signing.timestamp = ticks(time.time()) if timestamp is None else timestamp


class SignedVehicle(UdpVehicle):
    """A vehicle and a ground station that sign, and hear signed messages only."""

    def __init__(self, port):
        super().__init__(port)
        for end in (self.out, self.ground, self.ear):
            sign(end)
        self.ear.signing.timestamp = 0


def limit(vehicle):
    """What the companion says of a parameter when it is asked rightly."""
    request = mav.MAVLink_param_request_read_message(1, 191, b"DOB_LIMIT", -1)
    vehicle.send(request, by=vehicle.ground)
    return vehicle.wait(lambda m: m.get_type() == "PARAM_VALUE" and m.param_id == "DOB_LIMIT").param_value


def summary(process):
    process.terminate()
    return process.stderr.read()


def test_signed_peers_fly_and_every_answer_is_signed(design, config):
    port = free_port()
    with daemon(design, port, "--config", config), SignedVehicle(port) as vehicle:
        vehicle.activate()
        assert vehicle.fly(1)[0].x == pytest.approx(-0.2, abs=1e-3)
        assert all(message.get_signed() for message in vehicle.said)


@pytest.mark.parametrize("forged", ["unsigned", "wrong", "replayed"])
def test_forged_writes_and_samples_change_nothing_and_are_counted(design, config, forged):
    port = free_port()
    with daemon(design, port, "--config", config) as process, SignedVehicle(port) as vehicle:
        vehicle.fly(600)
        vehicle.write("DOB_LIMIT", 0.25)
        old = bytes(mav.MAVLink_param_set_message(1, 191, b"DOB_LIMIT", 1.0, 9).pack(vehicle.ground))
        vehicle.write("DOB_LIMIT", 0.125)
        forger = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        if forged == "wrong":
            sign(forger, key=bytes(32))
        if forged == "replayed":
            vehicle.socket.send(old)
        else:
            vehicle.send(mav.MAVLink_param_set_message(1, 191, b"DOB_LIMIT", 1.0, 9), by=forger)
            stamp = 1_000_000 + 4000 * vehicle.sample
            vehicle.send(mav.MAVLink_highres_imu_message(stamp, *[9.0] * 13, 63), by=forger)
        assert limit(vehicle) == 0.125
        (answer,) = vehicle.fly(1, rates=(0.0, 0.0, 0.0))
        assert (answer.x, answer.y, answer.z) == (0.0, 0.0, 0.0)
        said = summary(process)
    assert f"{1 if forged == 'replayed' else 2} {forged}" in said


def test_timestamps_go_on_after_a_kill_with_the_newest_kept_on_disk(design, config, tmp_path):
    port = free_port()
    with daemon(design, port, "--config", config) as process, SignedVehicle(port) as vehicle:
        vehicle.fly(2)
        process.kill()
    ahead = ticks(time.time()) + 10**9  # as after a flight with a clock that was then set back by hours
    (tmp_path / "state" / "signing-timestamp").write_text(f"{ahead}\n")
    with daemon(design, port, "--config", config), SignedVehicle(port) as vehicle:
        sign(vehicle.out, timestamp=ahead + AHEAD)
        vehicle.ear.signing.timestamp = ahead
        vehicle.send(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3))
        assert vehicle.fly(1)[0].get_signed()


@pytest.mark.parametrize(
    ("content", "mode", "words"),
    [
        (KEY.hex(), 0o644, "mode 0644, expected 0600"),
        (KEY.hex()[:-2], 0o600, "64 hexadecimal digits"),
        ("hover", 0o600, "64 hexadecimal digits"),
        (None, 0o600, "cannot be read"),
    ],
)
def test_a_key_that_is_open_to_others_or_no_key_ends_the_start_in_one_line(
    design, config, tmp_path, content, mode, words
):
    key = tmp_path / "signing.key"
    key.unlink()
    if content is not None:
        key.write_text(content)
        key.chmod(mode)
    finished = run_cli("run", "--design", design, "--link", f"udpin:127.0.0.1:{free_port()}", "--config", config)
    assert finished.returncode == 2
    assert words in finished.stderr.splitlines()[-1]
    assert KEY.hex()[:-2] not in finished.stderr


def test_a_key_without_a_state_directory_is_refused(design, config, tmp_path):
    config.write_text(f'signing_key_file = "{tmp_path}/signing.key"\n')
    finished = run_cli("run", "--design", design, "--link", f"udpin:127.0.0.1:{free_port()}", "--config", config)
    assert (finished.returncode, "state_directory" in finished.stderr) == (2, True)


def test_mavproxy_with_the_key_toggles(design, config, tmp_path):
    flight = flying(design, "ardupilot", "--config", config, key=KEY.hex())
    with flight as ground, MavProxy(f"udpin:127.0.0.1:{ground}", tmp_path) as console:
        console.type(f"signing key {PASSPHRASE}")
        console.wait_for("online system 1")
        console.ask("vehicle 1:191", "Received 6 parameters")
        console.ask("param set DOB_ENABLE 1", "DOB WAITING: switched on")
        console.ask("param fetch DOB_ENABLE", "DOB_ENABLE = 1.0")


def test_doctor_says_how_what_it_hears_is_signed(config, tmp_path):
    cases = {
        KEY: "messages of the autopilot are signed with our key",
        bytes(32): "the autopilot has another key",
        b"": "turn signing on in the autopilot",
    }
    ports = {key: free_port() for key in cases}
    with ExitStack() as running, ThreadPoolExecutor(len(cases)) as doctors:
        for key, port in ports.items():
            running.enter_context(process("-m", "tests.clients.vehicle", "generic", port, free_port(), key.hex()))
        more = ("--seconds", "1.5", "--config", config)
        asked = {
            key: doctors.submit(run_cli, "doctor", "--link", f"udpin:127.0.0.1:{ports[key]}", *more) for key in cases
        }
    for key, words in cases.items():
        said = asked[key].result()
        text = " ".join(said.stdout.split())
        assert (words in text, said.stderr) == (True, "")
        unanswered = "the request for its rate is not answered" in text
        assert unanswered == (key == bytes(32))  # a vehicle with a key takes only what is signed with it
    assert int((tmp_path / "state" / "signing-timestamp").read_text()) > ticks(1.7e9)

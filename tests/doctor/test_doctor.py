"""`dob-companion doctor` as a process beside the simulated vehicle as another."""

import json
import subprocess
import sys

import pytest

from dob_companion.artifact import dumps
from tests.cli.processes import one_line, run_cli
from tests.clients.processes import process
from tests.companion.aircraft import small_design
from tests.ports import free_port


@pytest.fixture
def vehicle():
    companion, ground = free_port(), free_port()
    links = ("--link", f"udpout:127.0.0.1:{companion}", "--gcs", f"udpout:127.0.0.1:{ground}")
    with process("-m", "sitl", "calm", *links, stderr=subprocess.DEVNULL):
        yield f"udpin:127.0.0.1:{companion}"


def test_the_simulated_vehicle_is_fit(vehicle, tmp_path):
    design = tmp_path / "design.json"
    design.write_text(dumps(small_design(delay_samples=5, delay_margin=30))[0])
    finished = run_cli("doctor", "--link", vehicle, "--design", design, "--seconds", 2, "--json")
    said = json.loads(finished.stdout)
    assert (finished.returncode, said["fit"], said["profile"]) == (0, True, "sitl"), finished.stdout
    assert said["heard"][0] == {
        "system": 1,
        "component": 1,
        "autopilot": "generic",
        "vehicle": "vtol quadrotor",
        "armed": True,
        "signatures": {"unsigned": said["heard"][0]["signatures"]["unsigned"]},
    }
    (gyro,) = [stream for stream in said["streams"] if stream["message"] == "HIGHRES_IMU"]
    assert gyro["rate_by_stamp_hz"] == pytest.approx(250.0, rel=0.01)
    assert said["round_trip_ms"]["answered"] > 0


def test_silence_is_exit_1_with_a_remedy():
    finished = run_cli("doctor", "--link", f"udpin:127.0.0.1:{free_port()}", "--seconds", "0.5")
    assert finished.returncode == 1
    assert "nothing is heard" in finished.stdout
    assert "→ cable" in finished.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(("--link", "udp:nowhere"), "udpin:HOST:PORT"), (("--design", "nowhere.json"), "nowhere.json")],
)
def test_what_cannot_begin_is_one_line_and_exit_2(arguments, words):
    finished = run_cli("doctor", *arguments)
    assert finished.returncode == 2
    assert words in one_line(finished)


def test_too_short_a_time_is_a_usage_error():
    finished = subprocess.run(
        [sys.executable, "-m", "dob_companion", "doctor", "--seconds", "0"], capture_output=True, text=True, check=False
    )
    assert (finished.returncode, "0.5 to 3600" in finished.stderr) == (2, True)

"""Outputs that cannot be written: no flight ends by them, and each command keeps its exit code."""

import os
import shlex
import signal
import subprocess
import sys

import pytest

from dob_companion.artifact import dumps
from tests.cli.processes import PATIENCE_S, UdpVehicle
from tests.companion.aircraft import small_design
from tests.ports import free_port

PYTHON = shlex.quote(sys.executable)


@pytest.fixture
def design(tmp_path):
    path = tmp_path / "design.json"
    path.write_text(dumps(small_design())[0])
    return path


def shell(command, **more):
    """Run a command line in bash with pipefail, so that the exit code is that of the first that fails."""
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        **more,
    )


def test_a_result_keeps_its_exit_code_when_its_reader_goes_and_one_that_is_lost_is_said():
    doctor = f"{PYTHON} -m dob_companion doctor --seconds 0.5 --link udpin:127.0.0.1:{free_port()}"
    for redirection in ("| true", ">&-"):
        gone = shell(f"{doctor} {redirection}")
        assert (gone.returncode, gone.stderr) == (1, ""), "nobody is heard, which is 1"
    full = shell(f"{doctor} > /dev/full")
    assert full.returncode == 1
    assert full.stderr == "dob-companion: standard output cannot be written: No space left on device\n"


@pytest.mark.parametrize(
    ("redirection", "code", "words"),
    [("| head -1", 0, 0), ("> /dev/full", 1, 1), ("> /dev/full 2>&1", 1, 0), (">&- 2>&-", 0, 0)],
)
def test_help_that_cannot_be_written(redirection, code, words):
    finished = shell(f"{PYTHON} -m dob_companion run --help {redirection}")
    assert finished.returncode == code
    assert len(finished.stderr.splitlines()) == words


@pytest.mark.parametrize("redirection", ["2>&-", "2> /dev/full", "2>&1 | true"])
def test_a_complaint_that_cannot_be_written_still_ends_with_its_exit_code(redirection):
    finished = shell(f"{PYTHON} -m dob_companion replay nowhere {redirection}")
    assert finished.returncode == 2


def test_characters_that_an_output_lacks_are_written_as_escapes(design):
    finished = shell(
        f"{PYTHON} -m dob_companion replay ünd", env=os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    )
    assert finished.returncode == 2
    assert "\\xfcnd" in finished.stderr


REDIRECTIONS = {
    "a reader that leaves": "2>&1 | head -3",
    "a full disk": "2> /dev/full",
    "JSON to a full disk": "--json > /dev/full",
    "JSON for a reader that leaves": "--json | head -3",
    "closed error output": "2>&-",
    "all closed": "<&- >&- 2>&-",
}


MORE = ("a reader that leaves", "JSON to a full disk", "closed error output")
"""The same ends of the other stream: `make proof`."""


@pytest.mark.parametrize(
    "redirection",
    [pytest.param(r, id=name, marks=pytest.mark.proof if name in MORE else ()) for name, r in REDIRECTIONS.items()],
)
def test_a_flight_goes_on_whatever_becomes_of_its_log(design, redirection, tmp_path):
    port, pid_file = free_port(), tmp_path / "pid"
    left, pipe, right = redirection.partition("|")
    run = f"exec {PYTHON} -m dob_companion run --design {design} --link udpin:127.0.0.1:{port} {left}"
    process = subprocess.Popen(
        ["bash", "-o", "pipefail", "-c", f"(echo $BASHPID > {pid_file}; {run}) {pipe}{right}"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    with UdpVehicle(port) as vehicle:
        vehicle.meet()
        for enable in range(20):  # each a burst of lines
            vehicle.write("DOB_ENABLE", float(enable % 2))
            vehicle.fly(5)
        vehicle.activate()
        assert vehicle.fly(1)[0].x == pytest.approx(-0.2, abs=1e-3)
        os.kill(int(pid_file.read_text()), signal.SIGTERM)
        last = vehicle.last_correction(process)
        assert (last.x, last.y, last.z) == (0.0, 0.0, 0.0)
    assert process.wait(PATIENCE_S) == 0


def test_a_hangup_ends_a_flight_with_its_fade_unless_nohup_has_it_ignored(design):
    for ignored in (False, True):
        port = free_port()
        hangup = f"env --{'ignore' if ignored else 'default'}-signal=HUP"
        run = f"exec {hangup} {PYTHON} -m dob_companion run --design {design} --link udpin:127.0.0.1:{port}"
        process = subprocess.Popen(["bash", "-c", run], stderr=subprocess.DEVNULL)
        with UdpVehicle(port) as vehicle:
            vehicle.meet()
            vehicle.activate()
            process.send_signal(signal.SIGHUP)
            if ignored:
                assert vehicle.fly(50)[-1].x == pytest.approx(-0.2, abs=1e-3)
                process.terminate()
            assert vehicle.last_correction(process).x == 0.0
        assert process.wait(PATIENCE_S) == 0


def test_a_terminal_that_closes_in_flight_ends_nothing(design):
    port = free_port()
    master, slave = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "dob_companion", "run", "--design", design, "--link", f"udpin:127.0.0.1:{port}"],
        stderr=slave,
    )
    os.close(slave)
    with UdpVehicle(port) as vehicle:
        vehicle.meet()
        vehicle.activate()
        os.close(master)
        for enable in (0.0, 1.0):
            vehicle.write("DOB_ENABLE", enable)
            vehicle.fly(300)
        assert vehicle.fly(1)[0].x == pytest.approx(-0.2, abs=1e-3)
        process.terminate()
        assert vehicle.last_correction(process).x == 0.0
    assert process.wait(PATIENCE_S) == 0

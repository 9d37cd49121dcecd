"""The recorder of a real daemon, broken on purpose: killed in flight, no room on the disk, nowhere to write."""

import json
import signal
from pathlib import Path

import pytest
from pymavlink import mavutil

from dob_companion.artifact import dumps
from dob_companion.files.segments import segments_in
from tests.cli.processes import UdpVehicle, daemon, run_cli
from tests.companion.aircraft import small_design
from tests.ports import free_port
from tests.recorder.flights import wait_until


@pytest.fixture
def design(tmp_path):
    path = tmp_path / "design.json"
    path.write_text(dumps(small_design())[0])
    return path


def recorded_to_the_end(directory):
    """Wait until no process that was given the directory is left: the scribe may start late on a busy computer."""

    def given(process):
        try:
            return str(directory).encode() in (process / "cmdline").read_bytes().split(b"\0")
        except OSError:  # it has gone meanwhile
            return False

    wait_until(lambda: not any(map(given, Path("/proc").glob("[0-9]*"))))


def replayed(directory):
    finished = run_cli("replay", directory, "--json")
    return finished.returncode, json.loads(finished.stdout)


def messages(path, kind):
    log = mavutil.mavlink_connection(str(path))
    found = []
    while (m := log.recv_match(type=kind)) is not None:
        found.append(m)
    return found


def test_after_kill_9_every_answer_that_the_vehicle_got_is_in_trace_and_tlog(design, tmp_path):
    flights, port = tmp_path / "flights", free_port()
    with daemon(design, port, "--record", flights) as process, UdpVehicle(port) as vehicle:
        answers = vehicle.activate().fly(50)
        process.send_signal(signal.SIGKILL)
        process.wait()
    recorded_to_the_end(flights)
    (segment,) = segments_in(flights)
    assert messages(segment.tlog, "DEBUG_VECT")[-1].time_usec == answers[-1].time_usec
    code, found = replayed(flights)
    assert code == 0
    assert found["identical"]
    assert found["corrections"] == vehicle.sample
    logged = messages(segment.tlog, "DEBUG_VECT")
    heard = [m for m in vehicle.said if m.get_type() == "DEBUG_VECT"]
    assert [m.get_msgbuf() for m in logged] == [m.get_msgbuf() for m in heard]
    assert len(messages(segment.tlog, "HIGHRES_IMU")) == vehicle.sample


def test_after_sigterm_the_record_is_whole_up_to_the_last_zero(design, tmp_path):
    flights, port = tmp_path / "flights", free_port()
    with daemon(design, port, "--record", flights) as process, UdpVehicle(port) as vehicle:
        vehicle.activate()
        process.send_signal(signal.SIGTERM)
        last = vehicle.last_correction(process)
        assert process.returncode == 0
    code, found = replayed(flights)
    assert (code, found["torn"], found["damaged"], found["lost_turns"]) == (0, [], {}, 0)
    (segment,) = segments_in(flights)
    assert messages(segment.tlog, "DEBUG_VECT")[-1].get_msgbuf() == last.get_msgbuf()


def test_a_daemon_started_again_records_the_next_flight(design, tmp_path):
    flights, port = tmp_path / "flights", free_port()
    for _ in range(2):
        with daemon(design, port, "--record", flights) as process, UdpVehicle(port) as vehicle:
            vehicle.fly(20)
            process.send_signal(signal.SIGKILL)
            process.wait()
        recorded_to_the_end(flights)
        assert replayed(flights)[1]["corrections"] == 20
    assert [segment.flight for segment in segments_in(flights)] == [1, 2]


def test_a_directory_that_cannot_be_written_is_one_line_and_exit_2(design, tmp_path):
    finished = run_cli("run", "--design", design, "--link", f"udpin:127.0.0.1:{free_port()}", "--record", "/proc/here")
    assert finished.returncode == 2
    assert "/proc/here" in finished.stderr.splitlines()[-1]
    finished = run_cli("run", "--design", design, "--record", tmp_path, "--record-segments", "1")
    assert finished.returncode == 2
    assert "record: segments: expected a whole number from 2 to 1e+06, got 1" in finished.stderr.splitlines()[-1]


def test_the_configuration_says_where_to_record_and_the_command_line_goes_before_it(design, tmp_path):
    config = tmp_path / "dob.toml"
    config.write_text(f'[record]\ndir = "{tmp_path}/configured"\nsegments = 1000\n')
    for more, directory in (((), "configured"), (("--record", tmp_path / "asked"), "asked")):
        link = f"udpin:127.0.0.1:{free_port()}"
        finished = run_cli("run", "--design", design, "--link", link, "--config", config, *more, "--timeout", "0.2")
        assert finished.returncode == 1
        assert len(segments_in(tmp_path / directory)) == 1
    finished = run_cli("run", "--design", design, "--config", config, "--record-mb", "0.01")
    assert finished.returncode == 2
    assert "record: mb: expected a number from 0.1 to 1e+06, got 0.01" in finished.stderr

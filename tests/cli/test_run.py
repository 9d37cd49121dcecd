"""`dob-companion run` as a process over a real socket."""

import json
import signal
import time
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path

import pytest

from dob_companion.artifact import dumps, sha256_of
from dob_companion.cli.main import main
from tests.cli.processes import PATIENCE_S, UdpVehicle, daemon, one_line, run_cli, run_here
from tests.companion.aircraft import small_design
from tests.ports import free_port


@pytest.fixture
def design(tmp_path):
    path = tmp_path / "design.json"
    path.write_text(dumps(small_design())[0])
    return path


def altered(path, change, seal=True):
    obj = json.loads(path.read_text())
    change(obj)
    if seal:
        obj["sha256"] = sha256_of(obj)
    path.write_text(json.dumps(obj))
    return path


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 0), (signal.SIGINT, 130)])
def test_a_signal_in_flight_fades_ends_with_zero_and_the_right_exit_code(design, number, code):
    port = free_port()
    with daemon(design, port) as process, UdpVehicle(port) as vehicle:
        vehicle.activate()
        assert vehicle.fly(1)[0].x == pytest.approx(-0.2, abs=1e-3)
        process.send_signal(number)
        last = vehicle.last_correction(process)
        assert (last.x, last.y, last.z) == (0.0, 0.0, 0.0)
        assert process.returncode == code


def test_a_daemon_that_stood_still_answers_nothing_old_but_by_zero_and_ramps_in_again(design):
    port = free_port()
    with daemon(design, port) as process, UdpVehicle(port) as vehicle:
        vehicle.activate()
        process.send_signal(signal.SIGSTOP)
        stopped(process, vehicle)
        before, backlog = len(vehicle.said), {vehicle.stamp + 4000 * k for k in range(100)}
        vehicle.fly(100, wait=False)
        process.send_signal(signal.SIGCONT)
        vehicle.beat()
        vehicle.fly(1)
        old = [m for m in vehicle.said[before:] if m.get_type() == "DEBUG_VECT" and m.time_usec in backlog]
        assert {(m.x, m.y, m.z) for m in old} == {(0.0, 0.0, 0.0)}
        sizes = [abs(m.x) for m in vehicle.fly(600)]
        assert sizes[0] == 0.0
        assert max(after - before for before, after in pairwise(sizes)) <= 0.2 * 0.004 / 0.5 + 1e-6
        assert sizes[-1] == pytest.approx(0.2, abs=1e-3)


def stopped(process, vehicle):
    """Wait until the process stands still; what it said before is heard."""
    deadline = time.monotonic() + PATIENCE_S
    while Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[0] != "T":
        assert time.monotonic() < deadline
    while vehicle.hear(0.05):
        pass


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_before_any_vehicle_ends_at_once(design, number):
    with daemon(design, free_port()) as process:
        process.send_signal(number)
        assert process.wait(PATIENCE_S) == (0 if number == signal.SIGTERM else 130)


def test_events_and_status_come_as_json_lines_when_asked(design):
    finished = run_cli(
        "run", "--design", design, "--link", f"udpin:127.0.0.1:{free_port()}", "--timeout", "0.3", "--json"
    )
    lines = [json.loads(line) for line in finished.stdout.splitlines()]
    assert any("status" in line for line in lines)
    assert any("listening" in line.get("event", "") for line in lines)
    times = [datetime.fromisoformat(line["time"]) for line in lines]
    assert times == sorted(times)
    assert abs(times[-1] - datetime.now(UTC)) < timedelta(minutes=10)


def test_no_vehicle_within_the_timeout_is_one_line_and_exit_1(design):
    finished = run_cli("run", "--design", design, "--link", f"udpin:127.0.0.1:{free_port()}", "--timeout", "0.2")
    assert finished.returncode == 1
    assert "no vehicle" in finished.stderr.splitlines()[-1]


def test_a_port_in_use_is_one_line_and_exit_2(design):
    port = free_port()
    with daemon(design, port):
        finished = run_cli("run", "--design", design, "--link", f"udpin:127.0.0.1:{port}")
        assert finished.returncode == 2
        assert f"udpin:127.0.0.1:{port}" in one_line(finished)
        assert "in use" in one_line(finished)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d["blocks"][0]["A"][0].__setitem__(0, 0.6), "sha256"),
        (lambda d: d.__setitem__("schema", "dob-companion/design/9"), "schema"),
    ],
)
def test_a_design_edited_by_hand_is_refused(design, change, words):
    finished = run_cli("run", "--design", altered(design, change, seal=False), "--timeout", "1")
    assert finished.returncode == 2
    assert words in one_line(finished)
    assert "design.json" in one_line(finished)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.__setitem__("dt", 0.005), "dt is 0.005"),
        (lambda d: d["blocks"][0]["A"][0].__setitem__(0, 1.5), "spectral radius"),
        (lambda d: d["blocks"][0]["D"][0].__setitem__(1, 0.1), "direct path from u_e"),
        (lambda d: d["blocks"][1]["certificate"].__setitem__("gamma", 1.5), "certified gamma"),
        (lambda d: d["blocks"][1]["certificate"].__setitem__("disk_margin", 0.01), "disk_margin"),
        (lambda d: d["blocks"][1]["certificate"].__setitem__("delay_margin_samples", 0), "delay_margin_samples"),
        (lambda d: d["blocks"][1]["certificate"].__setitem__("command_leak", 0.1), "command_leak"),
        (lambda d: d["blocks"][1]["certificate"].pop("gamma"), "'gamma' is missing"),
        (lambda d: d["blocks"][1].__setitem__("B", [[1.0]]), "B is 1x1, expected 1x2"),
        (lambda d: d["blocks"][1].__setitem__("axes", ["nose"]), "nose"),
        (lambda d: d["blocks"][1].__setitem__("axes", ["roll"]), "roll"),
        (lambda d: d["blocks"][1].__setitem__("inputs", ["u_e.pitch", "y_n.pitch"]), "inputs"),
    ],
)
def test_an_unfit_design_is_refused_by_name_even_with_a_right_hash(design, change, words):
    finished = run_here("run", "--design", altered(design, change), "--timeout", "1")
    assert finished.returncode == 2
    assert words in one_line(finished)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"\xff\xfe", b'{"schema": NaN}', b"[" * 100000])
def test_a_file_that_is_no_design_is_one_line(tmp_path, content):
    path = tmp_path / "design.json"
    path.write_bytes(content)
    finished = run_here("run", "--design", path)
    assert finished.returncode == 2
    assert "design.json" in one_line(finished)


def test_a_missing_file_and_a_bad_url_are_one_line(design, tmp_path):
    missing = run_cli("run", "--design", tmp_path / "nowhere.json")
    assert missing.returncode == 2
    assert "nowhere.json" in one_line(missing)
    bad = run_cli("run", "--design", design, "--link", "upd:nowhere")
    assert bad.returncode == 2
    assert "udpin:HOST:PORT" in one_line(bad)


def test_every_command_has_help_with_an_example():
    top = run_cli("--help")
    assert top.returncode == 0
    for command in ("demo", "design", "inspect", "run", "param", "status"):
        assert command in top.stdout
        helped = run_cli(command, "--help")
        assert helped.returncode == 0
        assert f"example: dob-companion {command}" in helped.stdout


@pytest.mark.parametrize("interrupted", [True, False])
def test_ctrl_c_that_a_package_makes_another_error_of_is_still_130(monkeypatch, interrupted):
    """As one did that was interrupted while it looked up its own version; an error of our own stays one."""

    def broken(_args):
        try:
            raise KeyboardInterrupt if interrupted else ValueError
        except BaseException:
            raise NameError("PackageNotFoundError") from None

    monkeypatch.setattr("dob_companion.cli.status.run", broken)
    if interrupted:
        assert main(["status"]) == 130
    else:
        with pytest.raises(NameError):
            main(["status"])

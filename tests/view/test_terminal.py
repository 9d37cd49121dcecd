"""The live view of `dob-companion run` on a pseudo-terminal."""

import os
import signal
from pathlib import Path

import pytest

from dob_companion.view.drawing import bar
from tests.cli.processes import PATIENCE_S, UdpVehicle, daemon
from tests.ports import free_port
from tests.view.watching import shown


@pytest.mark.parametrize("columns", [80, 160])
def test_the_view_shows_the_state_the_link_the_bars_and_the_events(design, columns):
    port = free_port()
    with shown(design, port, columns=columns) as (process, terminal):
        terminal.wait_for("listening on udpin")
        with UdpVehicle(port) as vehicle:
            vehicle.activate()
            while True:  # the view is drawn from moments that come ten times a second of wall time
                vehicle.fly(50)
                terminal.read(0.0)
                if "ACTIVE  " in terminal.text:
                    break
            terminal.wait_for("DOB ACTIVE: faded in")
            terminal.wait_for(r"vehicle 1  \S+ of 250 Hz  delay 1 \(95 %: 1\), designed for 1\n")
            terminal.wait_for(r"axes roll pitch yaw  gain 1  limit 0.3\n")
            terminal.wait_for(r"roll   +│(█+) +d_hat \+0.2000  correction -0.2000")
            terminal.wait_for(r"stepped \d+  bridged 0  gaps 0  late 0  malformed 0  foreign 0\n")
            process.send_signal(signal.SIGTERM)
            assert vehicle.last_correction(process).x == 0.0
        assert process.returncode == 0
        while terminal.read(1.0):
            pass
        assert "stopped:" in terminal.text.splitlines()[-1]


def test_a_vehicle_that_has_gone_is_shown_as_gone(design):
    port = free_port()
    with shown(design, port) as (process, terminal):
        terminal.wait_for("listening on udpin")
        with UdpVehicle(port) as vehicle:
            vehicle.activate()
        terminal.wait_for(r"vehicle last heard \d+ s ago *\nvehicle 1  0.0 of 250 Hz  delay unknown, designed for 1\n")
        terminal.wait_for(r"roll +│ +d_hat \+0.0000  correction \+0.0000")
        process.terminate()
        assert process.wait(PATIENCE_S) == 0


def test_a_terminal_that_stands_still_does_not_keep_the_loop_from_answering(design):
    port = free_port()
    with shown(design, port) as (process, terminal):
        terminal.wait_for("listening on udpin")
        with UdpVehicle(port) as vehicle:
            vehicle.activate()
            for enable in range(200):  # each a burst of events; nobody reads the terminal from here on
                vehicle.write("DOB_ENABLE", float(enable % 2))
                assert len(vehicle.fly(10)) == 10
            os.kill(process.pid, signal.SIGTERM)
            assert vehicle.last_correction(process).x == 0.0
        assert process.returncode == 0


def test_a_view_that_is_killed_gives_way_to_plain_lines_and_the_cursor(design):
    port = free_port()
    with shown(design, port) as (process, terminal):
        terminal.wait_for("listening on udpin")
        (view,) = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        assert not terminal.cursor
        with UdpVehicle(port) as vehicle:
            vehicle.fly(20)
            os.kill(int(view), signal.SIGKILL)
            vehicle.fly(20)
            terminal.wait_for("live view: its process has ended, plain lines from here; the loop goes on\n")
            assert terminal.cursor
            vehicle.write("DOB_ENABLE", 1.0)
            terminal.wait_for(r"\d\d:\d\d:\d\d notice   DOB WAITING: switched on\n")
            process.terminate()
            vehicle.last_correction(process)
        assert process.returncode == 0


def test_a_log_that_is_no_terminal_gets_plain_lines(design):
    port = free_port()
    with daemon(design, port) as process, UdpVehicle(port) as vehicle:
        vehicle.fly(20)
        process.terminate()
        vehicle.last_correction(process)
        lines = process.stderr.read().splitlines()
    assert any("vehicle heard: system 1" in line for line in lines)
    assert "stopped:" in lines[-1]
    assert not any("\x1b" in line for line in lines)


def test_without_rich_a_terminal_gets_plain_lines(design, tmp_path, monkeypatch):
    (tmp_path / "sitecustomize.py").write_text(
        "import importlib.util as u\nfind = u.find_spec\n"
        "u.find_spec = lambda name, *more: None if name == 'rich' else find(name, *more)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with shown(design, free_port()) as (process, terminal):
        terminal.wait_for(r"\d\d:\d\d:\d\d info     listening on udpin")
        process.terminate()
        assert process.wait(PATIENCE_S) == 0
        while terminal.read(1.0):
            pass
    assert "────" not in terminal.text


def test_a_terminal_that_cannot_move_its_cursor_gets_plain_lines(design):
    with shown(design, free_port(), term="dumb") as (process, terminal):
        terminal.wait_for(r"\d\d:\d\d:\d\d info     listening on udpin")
        assert not Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()


@pytest.mark.parametrize(
    ("value", "drawn"),
    [(0.0, "    │    "), (0.15, "    │██  "), (-0.3, "████│    "), (5.0, "    │████"), (-0.01, "    │    ")],
)
def test_a_bar_grows_from_the_middle_and_ends_at_full_scale(value, drawn):
    assert bar(value, 0.3, 4) == drawn


def test_a_bar_without_a_scale_is_empty():
    assert bar(1.0, 0.0, 2) == "  │  "

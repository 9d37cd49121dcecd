"""A flight ends in good order with who started it, however that ends."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PATIENCE_S = 60.0
FLIGHT = """
import pathlib, sys, time
from tests.ardupilot.namespace import end_with
end_with(int(sys.argv[1]))
try:
    pathlib.Path(sys.argv[2], "flies").touch()
    time.sleep(600.0)
finally:
    pathlib.Path(sys.argv[2], "landed").touch()
"""
STARTER = """
import os, subprocess, sys
subprocess.run([sys.executable, "-c", sys.argv[1], str(os.getpid()), sys.argv[2]])
"""


def wait_for(path):
    deadline = time.monotonic() + PATIENCE_S
    while not path.exists():
        assert time.monotonic() < deadline, path
        time.sleep(0.02)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux only, as the flights are")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_flight_lands_when_its_starter_is_ended(number, tmp_path):
    starter = subprocess.Popen([sys.executable, "-c", STARTER, FLIGHT, str(tmp_path)], cwd=ROOT)
    wait_for(tmp_path / "flies")
    assert not (tmp_path / "landed").exists()
    starter.send_signal(number)
    starter.wait(PATIENCE_S)
    wait_for(tmp_path / "landed")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux only, as the flights are")
def test_a_starter_that_has_ended_already_is_noticed(tmp_path):
    command = [sys.executable, "-c", FLIGHT, str(os.getppid()), str(tmp_path)]
    assert subprocess.run(command, cwd=ROOT, check=False).returncode == 128 + signal.SIGTERM
    assert not (tmp_path / "flies").exists()

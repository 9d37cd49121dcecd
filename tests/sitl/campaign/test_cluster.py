"""A campaign on a real Dask cluster: a scheduler and two workers as processes, on loopback."""

import json
import os
import signal
import subprocess
import sys
from contextlib import ExitStack

import pytest

from sitl.campaign.cli import main
from tests.sitl.campaign.processes import FLIGHTS, arguments, kept, wait_for

DASK = (sys.executable, "-m", "dask")
ENVIRONMENT = os.environ | {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "20s"}


def start(stack: ExitStack, *command: str) -> subprocess.Popen[bytes]:
    process = stack.enter_context(
        subprocess.Popen([*DASK, *command], env=ENVIRONMENT, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    )
    stack.callback(process.kill)
    return process


@pytest.mark.proof  # a whole cluster; test_campaign.py kills a worker process on this computer
def test_a_lost_worker_loses_nothing(design, short, flown, tmp_path):
    """One of two workers is killed in the middle; the rows are those of a campaign on this computer."""
    whole, _, _ = flown
    file = tmp_path / "scheduler.json"
    with ExitStack() as stack:
        scheduler = start(
            stack, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)
        )
        wait_for(lambda: file.exists() and file.read_text().endswith("}"), scheduler)
        address = json.loads(file.read_text())["address"]
        settings = ("--host", "127.0.0.1", "--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory")
        workers = [start(stack, "worker", address, *settings, str(tmp_path)) for _ in range(2)]
        out = tmp_path / "cluster"
        command = arguments(design, short, out, "--scheduler", address)
        campaign = stack.enter_context(
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        )
        stack.callback(campaign.kill)
        wait_for(lambda: len(kept(out)) >= 2, campaign)
        workers[0].send_signal(signal.SIGKILL)
        _, errors = campaign.communicate()
        assert campaign.returncode == 0, errors
    assert len(kept(out)) == FLIGHTS
    assert (out / "flights.parquet").read_bytes() == (whole / "flights.parquet").read_bytes()


def test_a_scheduler_that_is_not_there_is_told_in_one_line(design, short, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sitl.campaign.cluster.CONNECT_S", 1)
    given = arguments(design, short, tmp_path / "dir", "--scheduler", "tcp://127.0.0.1:1")[3:]
    assert main(given) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("campaign: --scheduler tcp://127.0.0.1:1: no Dask scheduler answers")

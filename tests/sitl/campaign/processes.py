"""The campaign as a process, and a look at what it has kept so far."""

import contextlib
import subprocess
import sys
from pathlib import Path
from time import monotonic

import pyarrow.parquet as pq

from tests.cli.processes import PATIENCE_S

COMMAND = (sys.executable, "-m", "sitl.campaign")


def arguments(design: Path, short: Path, out: Path, *more: object) -> list[str]:
    """8 flights: 2 seeds, each with its own plant gain, at two delays and with two designs (the same one twice)."""
    given = ["--scenario", short, "--designs", f"a={design},b={design}", "--delays", "1,2", "--gain", "0.7..1.3"]
    return [*COMMAND, *map(str, [*given, "--seeds", 2, "-o", out, *more])]


FLIGHTS = 8


def run(command: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=None, check=False)


def kept(out: Path) -> set[int]:
    """Numbers of the flights whose rows are on disk."""
    files = [out / "flights.parquet"] if (out / "flights.parquet").exists() else sorted(out.glob("parts/0*.parquet"))
    return {number for file in files for number in pq.read_table(file)["flight"].to_pylist()}


def wait_for(holds, process: subprocess.Popen[str]) -> None:
    """Until `holds()`, while the process is at work."""
    deadline = monotonic() + PATIENCE_S
    while not holds():
        assert process.poll() is None, "it ended before"
        assert monotonic() < deadline
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.05)

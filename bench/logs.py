"""Reading logs: MB/s of ours, of pymavlink's own loop over messages, and of pyulog, in one run.

The logs are made here: what a copter writes with fast attitude and IMU at 400 Hz, what a quadrotor of PX4 writes.
"""

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pyulog
from pymavlink.DFReader import DFReader_binary

from dob_companion.logs import read_log
from tests.logs import writers

MEGABYTES = float(os.environ.get("BENCH_MEGABYTES", "100"))
_LIKE_MB = 5.0
"""The readers of others take so long that a part of it has to do."""


def measure() -> Iterator[str]:
    """MB/s and ratio for each kind of log; ours over the whole, theirs over a part."""
    with tempfile.TemporaryDirectory() as name:
        yield f"{'MB/s':12}{'ours':>8}{'theirs':>9}{'ratio':>8}     ours, whole"
        for kind, make, theirs in (
            (".bin", lambda flight: writers.copter(*flight).data, _by_pymavlink),
            (".ulg", lambda flight: writers.quad(*flight).data, _by_pyulog),
        ):
            part, whole = Path(name) / f"part{kind}", Path(name) / f"whole{kind}"
            size = _write(part, make, _LIKE_MB)
            speed = size / _seconds(theirs, part)
            size = _write(whole, make, MEGABYTES)
            took = _seconds(read_log, whole)
            yield f"{kind:12}{size / took:>8.1f}{speed:>9.1f}{size / took / speed:>8.1f}   {size:.0f} MB, {took:.1f} s"


def _write(path: Path, make: Callable[[tuple], bytes], megabytes: float) -> float:
    """Returns the size in MB: near enough to what is asked for."""
    short = len(make(writers.some_flight(seconds=10.0, rate_hz=400.0))) / 1e6
    path.write_bytes(make(writers.some_flight(seconds=10.0 * megabytes / short, rate_hz=400.0)))
    return path.stat().st_size / 1e6


def _by_pymavlink(path: Path) -> None:
    reader = DFReader_binary(str(path))
    while reader.recv_msg() is not None:
        pass


def _by_pyulog(path: Path) -> None:
    pyulog.ULog(str(path))


def _seconds(read: Callable[[Path], object], path: Path) -> float:
    begin = time.perf_counter()
    read(path)
    return time.perf_counter() - begin

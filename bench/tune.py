"""From a log of 100 MB to a finished three-axis design: reading, identifying, designing.

The log is made here: a copter that flew System ID mode about one axis after another, and all that it logs besides.
Beside it in the same run: the bytes of the file read and added up, and a product of matrices.
"""

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bench._long_log import long_log
from dob_companion.cli.design import design_into
from dob_companion.cli.identification_options import Options
from dob_companion.cli.identifying import SPEC, of_logs
from dob_companion.logs import read_log

MEGABYTES = float(os.environ.get("BENCH_MEGABYTES", "100"))
SIZE = 2000
T = TypeVar("T")
Array = NDArray[np.float64]


def measure() -> Iterator[str]:
    """Seconds of each step and of the floors."""
    matrix = np.random.default_rng(1).standard_normal((SIZE, SIZE))
    with tempfile.TemporaryDirectory() as name:
        log, out = Path(name) / "flight.bin", Path(name) / "out"
        log.write_bytes(long_log(MEGABYTES))
        floor, _ = _timed(lambda: int(np.frombuffer(log.read_bytes(), np.uint8).sum()))
        read, _ = _timed(lambda: read_log(log))
        both, outcome = _timed(lambda: of_logs([log], Options()))
        if outcome.spec is None or len(outcome.found.usable) < 3:
            raise SystemExit(outcome.why or "; ".join(one.why for one in outcome.found.axes.values()))
        outcome.write(out)
        made, (design, _) = _timed(lambda: design_into(out, out / SPEC, auto=True))
        product, _ = _timed(lambda: matrix @ matrix)
        axes = ", ".join(block.name for block in design.blocks)
        yield f"{log.stat().st_size / 1e6:.0f} MB, a design about {axes}; {os.cpu_count()} cores"
        yield f"{'':28}{'wall, s':>8} {'of cores, s':>12}"
        for step, took in {
            "bytes of the file added up": floor,
            "reading": read,
            "identifying": both - read,
            "design --auto, its page": made,
            "log to design": both + made,
            f"a product of {SIZE} x {SIZE}": product,
        }.items():
            yield f"{step:28}{took[0]:8.2f} {took[1]:12.2f}"


def _timed(step: Callable[[], T]) -> tuple[Array, T]:
    """Seconds by the clock and of all cores together, children that have ended included; what other programs take of
    the computer is in the first alone."""
    begin = _now()
    found = step()
    return _now() - begin, found


def _now() -> Array:
    return np.array([time.perf_counter(), sum(os.times()[:4])])

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

from bench._long_log import long_log
from dob_companion.cli.design import design_into
from dob_companion.cli.identification_options import Options
from dob_companion.cli.identifying import SPEC, of_logs
from dob_companion.logs import read_log

MEGABYTES = float(os.environ.get("BENCH_MEGABYTES", "100"))
SIZE = 2000
T = TypeVar("T")


def measure() -> Iterator[str]:
    """Seconds of each step and of the floors."""
    matrix = np.random.default_rng(1).standard_normal((SIZE, SIZE))
    with tempfile.TemporaryDirectory() as name:
        log, out = Path(name) / "flight.bin", Path(name) / "out"
        log.write_bytes(long_log(MEGABYTES))
        floor_s, _ = _timed(lambda: int(np.frombuffer(log.read_bytes(), np.uint8).sum()))
        read_s, _ = _timed(lambda: read_log(log))
        both_s, outcome = _timed(lambda: of_logs([log], Options()))
        if outcome.spec is None or len(outcome.found.usable) < 3:
            raise SystemExit(outcome.why or "; ".join(one.why for one in outcome.found.axes.values()))
        outcome.write(out)
        design_s, (design, _) = _timed(lambda: design_into(out, out / SPEC, auto=True))
        product_s, _ = _timed(lambda: matrix @ matrix)
        axes = ", ".join(block.name for block in design.blocks)
        yield f"{log.stat().st_size / 1e6:.0f} MB, a design about {axes}; {os.cpu_count()} cores"
        yield f"bytes of the file added up  {floor_s:6.2f} s"
        yield f"reading                     {read_s:6.1f} s"
        yield f"identifying                 {both_s - read_s:6.1f} s"
        yield f"design --auto               {design_s:6.1f} s"
        yield f"log to design               {both_s + design_s:6.1f} s"
        yield f"a product of {SIZE} x {SIZE}    {product_s:6.2f} s"


def _timed(step: Callable[[], T]) -> tuple[float, T]:
    begin = time.perf_counter()
    found = step()
    return time.perf_counter() - begin, found

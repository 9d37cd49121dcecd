"""Lockstep over the wire: how much faster than real time vehicle and companion fly as two processes over UDP.

Counted from hover to the end, so without design, start-up and the search for the disturbance's strength; the ratio is
that of flight time to wall time.
"""

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dob_companion.demo import Demo, fly
from dob_companion.demo.screen import PlainScreen

SPEC = Path(__file__).parents[1] / "examples" / "tailsitter_paper.toml"
SCENARIOS = ("paper", "paper_nonlinear")
HOVER, END = "sitl: hover reached", "sitl: flight complete"


class _Watch(PlainScreen):
    """Notes when each text came first; prints nothing."""

    def __init__(self) -> None:
        self.at: dict[str, float] = {}

    def text(self, text: str) -> None:
        self.at.setdefault(text, time.monotonic())

    def note(self, text: str) -> None:
        pass


def measure() -> Iterator[str]:
    """Wall time and ratio of each scenario, from hover to the end."""
    yield f"{'scenario':18}{'flight, s':>10}{'wall, s':>9}{'x real time':>13}"
    for name in SCENARIOS:
        with tempfile.TemporaryDirectory() as directory:
            watch, out = _Watch(), Path(directory)
            fly(Demo(spec=SPEC, out=out, seed=1, fast=True, scenario=name), watch)
            with np.load(out / "flight.npz") as flown:
                flight = (flown["stamp_us"][-1] - flown["stamp_us"][np.flatnonzero(flown["window"])[0]]) * 1e-6
        wall = watch.at[END] - watch.at[HOVER]
        yield f"{name:18}{flight:>10.1f}{wall:>9.1f}{flight / wall:>13.1f}"

"""How often the truth lies in what is reported, counted over simulated flights:

    python -m tests.identification.coverage [--flights N]

A tail-sitter with a flexible mode, wind, noise and a late link, excited for 90 s, each flight in air of its own.
The true response counts as held where it is within the model's bound at all of LOOKED_AT_HZ, which is more than was
excited. Prints a table for docs.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from functools import cache

import numpy as np

from dob_companion.identification.identify import identify
from dob_companion.identification.result import AxisResult, Identification
from tests.identification.hovering import Axis, fly, record

LINK_S = 0.008
"""Two samples."""

LOOKED_AT_HZ = (0.1, 100.0)
FIRST_SEED = 1000
COLUMNS = ("usable", "bound", "gain", "slow pole", "lag", "delay")


def bending(s):
    """A wing's first mode: a dip and a peak of 3 % damping, 12 and 13 Hz."""
    dip, peak = 2.0 * np.pi * 12.0, 2.0 * np.pi * 13.0
    return (1.0 + 0.06 * s / dip + (s / dip) ** 2) / (1.0 + 0.06 * s / peak + (s / peak) ** 2)


ROLL = Axis(gain=590.0, pole=0.0, lag=0.0705, delay=0.004 + LINK_S, p=0.03, i=0.03, attitude=3.0, shape=bending)
PITCH = Axis(gain=1735.0, pole=0.3, lag=0.0704, delay=0.0005 + LINK_S, p=0.012, i=0.01, attitude=3.0)
YAW = Axis(gain=198.0, pole=0.4, lag=0.0665, delay=LINK_S, p=0.05, i=0.03, attitude=2.0, wind=1.0,
           shape=lambda s: 1.0 + 0.035 * s)  # fmt: skip
AXES = {"roll": ROLL, "pitch": PITCH, "yaw": YAW}


@cache
def flight(seed: int) -> Identification:
    """What is found of one flight."""
    return identify(record(fly(AXES.values(), 90, seed, coupling=0.02, band=(0.15, 100.0))))


def held(found: AxisResult) -> dict[str, bool]:
    """Of COLUMNS, what is usable and what holds the truth."""
    model, truth = found.model, AXES[found.axis]
    if not found.usable or model is None:
        return dict.fromkeys(COLUMNS, False)
    w = 2.0 * np.pi * np.geomspace(*LOOKED_AT_HZ, 400)
    off = np.abs(truth.held(w, 0.004) / model.response(w, 250.0) - 1.0)
    pairs = {
        "gain": (model.acceleration_per_unit, truth.gain),
        "slow pole": (model.slow_pole_rad_s, truth.pole),
        "lag": (model.lag_s, truth.lag),
        "delay": (model.delay_s, truth.delay),
    }
    return {"usable": True, "bound": bool(np.all(off <= model.bound.at(w / (2.0 * np.pi))))} | {
        name: each.low <= true <= each.high for name, (each, true) in pairs.items()
    }


def counted(flights: int) -> dict[str, Counter[str]]:
    """How many of so many flights hold each of COLUMNS, by axis."""
    found: dict[str, Counter[str]] = {axis: Counter() for axis in AXES}
    for seed in range(FIRST_SEED, FIRST_SEED + flights):
        for axis, result in flight.__wrapped__(seed).axes.items():
            found[axis] += Counter(name for name, holds in held(result).items() if holds)
    return found


def table(found: dict[str, Counter[str]], flights: int) -> Iterator[str]:
    """For docs."""
    yield f"| of {flights} flights | {' | '.join(COLUMNS)} |"
    yield "| --- |" + " --: |" * len(COLUMNS)
    for axis, count in found.items():
        yield f"| {axis} | {' | '.join(str(count[name]) for name in COLUMNS)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=100, metavar="N")
    flights = parser.parse_args().flights
    print("\n".join(table(counted(flights), flights)))


if __name__ == "__main__":
    main()

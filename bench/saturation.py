"""Where the loop saturates: cost of a sample, hence the highest rate, for more states, one axis, and faster stamps.

Without a socket: two messages in, the correction out, as in `step`. The reference is the paper's design at 250 Hz,
measured in turn with each other one. Every further state is a stable mode of its own, coupled to all of an axis'
inputs.
"""

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from pymavlink.dialects.v20 import common as mav

from bench._peers import HEARTBEAT, imu, paper_design, target
from dob_companion.artifact import DobDesign, StateSpaceData
from dob_companion.companion import Companion

SAMPLES, WARM_UP = 1500, 300


def measure() -> Iterator[str]:
    design = paper_design()
    order = sum(block.observer.order for block in design.blocks)
    cases = [(f"{order + 3 * more} states", _grown(design, more), 4000) for more in (0, 8, 24, 56, 120)]
    cases += [("one axis", replace(design, blocks=design.blocks[:1]), 4000)]
    cases += [(f"stamps at {1_000_000 // us} Hz", design, us) for us in (1000, 500, 250)]
    yield f"{'':18}{'median µs':>11}{'ratio':>8}{'saturates at, Hz':>18}{'share at its rate':>19}"
    for name, case, step_us in cases:
        own, reference = _in_turn((case, step_us), (design, 4000))
        yield f"{name:18}{own:>11.1f}{own / reference:>8.2f}{1e6 / own:>18.0f}{own / step_us:>19.1%}"


def _in_turn(*cases: tuple[DobDesign, int]) -> list[float]:
    """Median microseconds of a sample of each, one sample of each in turn."""
    flights = [_flight(*case) for case in cases]
    times = np.array([[next(flight) for flight in flights] for _ in range(WARM_UP + SAMPLES)])
    return [float(t) for t in np.median(times[WARM_UP:], axis=0)]


def _flight(design: DobDesign, step_us: int) -> Iterator[float]:
    companion, out = Companion(design), mav.MAVLink(None, srcSystem=1, srcComponent=1)
    companion.receive(bytes(HEARTBEAT.pack(out)), 0.0)
    rng = np.random.default_rng(1)
    for stamp in range(step_us, 1 << 62, step_us):
        question = bytes(imu(stamp, rng.normal(0.0, 1e-3, 3)).pack(out))
        after = bytes(target(stamp).pack(out))
        now = stamp * 1e-6
        begin = time.perf_counter_ns()
        companion.receive(question, now)
        companion.receive(after, now)
        companion.advance(now)
        answer = companion.bytes_to_send()
        took = time.perf_counter_ns() - begin
        assert answer, f"stamp {stamp} was not answered"
        yield took * 1e-3


def _grown(design: DobDesign, more: int) -> DobDesign:
    """`more` states for each block."""
    return replace(design, blocks=tuple(replace(b, observer=_with(b.observer, more)) for b in design.blocks))


def _with(observer: StateSpaceData, more: int) -> StateSpaceData:
    n, inputs, outputs = observer.order, observer.B.shape[1], observer.C.shape[0]
    A = np.zeros((n + more, n + more))
    A[:n, :n], A[n:, n:] = observer.A, np.diag(np.linspace(0.1, 0.9, more))
    return StateSpaceData(
        A,
        np.vstack([observer.B, np.full((more, inputs), 1e-3)]),
        np.hstack([observer.C, np.full((outputs, more), 1e-6)]),
        observer.D,
    )

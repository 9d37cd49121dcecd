"""One sample through the companion: both messages' bytes in, correction's bytes out, without a socket.

The reference is what MAVLink alone costs: the same two messages decoded and one DEBUG_VECT packed by pymavlink.
"""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import Companion, CompanionConfig
from dob_companion.synthesis import design_from_toml

SPEC = Path(__file__).parents[1] / "examples" / "tailsitter_paper.toml"
SAMPLES = 10_000
WARM_UP = 1_000
DT_US = 4000


def measure() -> Iterator[str]:
    """Median and 99th percentile of both, a sample each in turn."""
    design = design_from_toml(SPEC.read_text(encoding="utf-8"), str(SPEC), "2026-01-01T00:00:00Z")
    companion = Companion(design, CompanionConfig(), now=0.0)
    out, ear = mav.MAVLink(None, srcSystem=1, srcComponent=1), mav.MAVLink(None)
    ear.robust_parsing = True
    heartbeat = mav.MAVLink_heartbeat_message(2, 12, 128, 0, 4, 3)
    companion.receive(bytes(heartbeat.pack(out)), 0.0)
    rng = np.random.default_rng(1)
    steps, references = np.empty(SAMPLES), np.empty(SAMPLES)
    for k in range(-WARM_UP, SAMPLES):
        stamp, rates = (k + WARM_UP + 1) * DT_US, rng.normal(0.0, 0.1, 3)
        imu = mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, *rates, 0, 0, 0, 0, 0, 0, 0, 56)
        moment = mav.MAVLink_actuator_control_target_message(stamp, 0, [0, 0, 0, 0.5, 0, 0, 0, 1])
        pair = [bytes(imu.pack(out)), bytes(moment.pack(out))]
        step, answers = _timed(lambda p=pair, s=stamp: _answer(companion, p, s * 1e-6))
        reference, _ = _timed(lambda p=pair, s=stamp: _mavlink_alone(ear, p, s))
        assert answers, f"sample {k} was not answered"
        if k >= 0:
            steps[k], references[k] = step, reference
    yield f"{'µs':22}{'median':>8}{'p99':>8}"
    for name, times in (("companion", steps), ("MAVLink alone", references)):
        yield f"{name:22}{np.median(times):>8.1f}{np.percentile(times, 99):>8.1f}"
    yield f"{'ratio of medians':22}{np.median(steps) / np.median(references):>8.2f}"
    yield f"{'share of one period':22}{np.median(steps) / DT_US:>8.2%}"


def _answer(companion: Companion, pair: list[bytes], now: float) -> list[bytes]:
    for data in pair:
        companion.receive(data, now)
    companion.advance(now)
    return companion.bytes_to_send()


def _mavlink_alone(ear: mav.MAVLink, pair: list[bytes], stamp: int) -> bytes:
    for data in pair:
        ear.parse_buffer(data)
    return bytes(mav.MAVLink_debug_vect_message(b"DOB_CORR", stamp, 0.0, 0.0, 0.0).pack(ear))


def _timed(call: Callable[[], object]) -> tuple[float, object]:
    """Microseconds that a call takes, and what it returns."""
    begin = time.perf_counter_ns()
    result = call()
    return (time.perf_counter_ns() - begin) * 1e-3, result

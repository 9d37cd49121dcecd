"""One sample through the companion: both messages' bytes in, correction's bytes out, without a socket.

The reference is what MAVLink alone costs: the same two messages decoded and one DEBUG_VECT packed by pymavlink.

Below it, how long an answer takes (gyro message in, correction out) when the processor's caches hold what it needs,
when they hold something else, as after milliseconds of other work, and when it was rehearsed in between: why the
daemon rehearses (`runtime/rehearsal.py`).
"""

import time
from collections.abc import Callable, Iterator

import numpy as np
from pymavlink.dialects.v20 import common as mav

from bench._peers import HEARTBEAT, imu, paper_design, target
from dob_companion.artifact import DobDesign
from dob_companion.companion import Companion, CompanionConfig
from dob_companion.runtime.rehearsal import Rehearsal

SAMPLES = 10_000
WARM_UP = 1_000
COLD_SAMPLES = 250
DISPLACE_BYTES = 64 << 20
"""Written between two samples: more than the caches hold."""

DT_US = 4000


def measure() -> Iterator[str]:
    """Median and 99th percentile of both, a sample each in turn."""
    design = paper_design()
    companion = Companion(design, CompanionConfig(), now=0.0)
    out, ear = mav.MAVLink(None, srcSystem=1, srcComponent=1), mav.MAVLink(None)
    ear.robust_parsing = True
    companion.receive(bytes(HEARTBEAT.pack(out)), 0.0)
    rng = np.random.default_rng(1)
    steps, references = np.empty(SAMPLES), np.empty(SAMPLES)
    for k in range(-WARM_UP, SAMPLES):
        stamp, rates = (k + WARM_UP + 1) * DT_US, rng.normal(0.0, 0.1, 3)
        pair = [bytes(imu(stamp, rates).pack(out)), bytes(target(stamp).pack(out))]
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
    yield from _caches(design)


def _caches(design: DobDesign) -> Iterator[str]:
    """An answer after each of three ways to spend the time before it, a sample each in turn."""
    companion, out = Companion(design), mav.MAVLink(None, srcSystem=1, srcComponent=1)
    rehearsal, other = Rehearsal(companion), np.zeros(DISPLACE_BYTES, dtype=np.uint8)
    rng = np.random.default_rng(1)

    def receive(message: mav.MAVLink_message, now: float) -> float:
        data = bytes(message.pack(out))
        took, _ = _timed(lambda: companion.receive(data, now))
        rehearsal.heard(data, now)
        return took

    def displace() -> None:
        np.add(other, 1, out=other)

    ways = {"hot": (), "caches displaced": (displace,), "displaced, rehearsed": (displace, rehearsal.run)}
    found: dict[str, list[float]] = {way: [] for way in ways}
    for k in range(COLD_SAMPLES):
        for turn, (way, acts) in enumerate(ways.items(), start=1 + k * len(ways)):
            stamp, now = turn * DT_US, turn * DT_US * 1e-6
            if turn % 250 == 1:
                receive(HEARTBEAT, now)
            question = imu(stamp, rng.normal(0.0, 1e-3, 3))
            for act in acts:
                act()
            found[way].append(receive(question, now))
            receive(target(stamp), now)
            companion.advance(now)
            assert companion.bytes_to_send(), f"sample {turn} was not answered"
    yield f"{'an answer, µs':22}{'median':>8}{'p99':>8}"
    for way, times in found.items():
        yield f"{way:22}{np.median(times):>8.1f}{np.percentile(times, 99):>8.1f}"


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

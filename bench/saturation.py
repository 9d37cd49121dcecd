"""Where the loop saturates: cost of a sample, hence the highest rate, for more states, one axis, and faster stamps.

First without a socket: two messages in, the correction out, as in `step`. The reference is the paper's design at 250
Hz, measured in turn with each other one. Every further state is a stable mode of its own, coupled to all of an axis'
inputs.

Then the real daemon as a process of its own, asked over UDP on loopback at a fixed rate whether it keeps up or not. Its
design has the matrices of 250 Hz and says the rate that it is asked at: the cost is that of the rate, the numbers are
not looked at. `run` would refuse such a design; here it is told otherwise.
"""

import os
import select
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import common as mav

from bench._peers import HEARTBEAT, Peer, companion, imu, paper_design, target
from dob_companion.artifact import DobDesign, StateSpaceData
from dob_companion.companion import Companion
from dob_companion.runtime.priority import real_time

SAMPLES, WARM_UP = 1500, 300
RATES_HZ = (250, 500, 1000, 2000, 4000, 8000)
SECONDS, WARM_UP_S = 5.0, 2.0
LAST_ANSWERS_S = 0.5
AT_ANY_RATE = (
    "import sys; from dob_companion.cli import main; from dob_companion.mavlink import profiles; "
    "rate_hz = float(sys.argv.pop(1)); profiles.rate_hz = lambda asked: rate_hz; sys.exit(main.main())"
)


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
    yield f"the daemon over UDP, {SECONDS:g} s each; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    heads = (("asked at, Hz", 12), ("sent at", 9), ("answered", 10), ("median µs", 11), ("p99 µs", 9), ("one core", 10))
    yield "".join(f"{head:>{width}}" for head, width in heads)
    for rate in RATES_HZ:
        yield _asked_at(rate, design)


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


def _asked_at(rate_hz: int, design: DobDesign) -> str:
    """One row: what share of the samples was answered, how soon, and what the daemon used of a core."""
    pairs = _packed(rate_hz)
    program = ("-c", AT_ANY_RATE, str(rate_hz))
    with (
        tempfile.TemporaryDirectory() as name,
        companion(Path(name), replace(design, dt=1.0 / rate_hz), program) as peer,
    ):
        peer.send(HEARTBEAT)
        with real_time():
            _ask(peer, pairs[: round(WARM_UP_S * rate_hz)], rate_hz)
            cpu = peer.cpu_s()
            asked = pairs[round(WARM_UP_S * rate_hz) :]
            delays, took = _ask(peer, asked, rate_hz)
            share = (peer.cpu_s() - cpu) / took
    median, p99 = np.percentile(delays, (50, 99))
    answered = len(delays) / len(asked)
    return f"{rate_hz:>12}{len(asked) / took:>9.0f}{answered:>10.1%}{median:>11.0f}{p99:>9.0f}{share:>10.1%}"


def _packed(rate_hz: int) -> list[tuple[int, bytes, bytes]]:
    """Stamp and both messages of all samples, made before anything is measured."""
    out, rng = mav.MAVLink(None, srcSystem=1, srcComponent=1), np.random.default_rng(1)
    stamps = [round(1e6 * k / rate_hz) for k in range(1, round((WARM_UP_S + SECONDS) * rate_hz) + 1)]
    return [
        (stamp, bytes(imu(stamp, rng.normal(0.0, 1e-3, 3)).pack(out)), bytes(target(stamp).pack(out)))
        for stamp in stamps
    ]


def _ask(peer: Peer, pairs: list[tuple[int, bytes, bytes]], rate_hz: int) -> tuple[list[float], float]:
    """Send each pair when it is due, answered or not. Delays of the answers in µs, and how long the
    sending took in s."""
    sent: dict[int, float] = {}
    delays: list[float] = []
    begin = time.monotonic()
    for k, (stamp, question, after) in enumerate(pairs):
        _hear(peer, begin + k / rate_hz, sent, delays)
        sent[stamp] = time.monotonic()
        peer.socket.send(question)
        peer.socket.send(after)
        if k % rate_hz == 0:
            peer.send(HEARTBEAT)
    took = time.monotonic() - begin
    _hear(peer, time.monotonic() + LAST_ANSWERS_S, sent, delays)
    return delays, took


def _hear(peer: Peer, until: float, sent: dict[int, float], delays: list[float]) -> None:
    """Take answers until then; at least those that are there."""
    while True:
        left = until - time.monotonic()
        if not select.select([peer.socket], [], [], max(0.0, left))[0]:
            return
        answer, now = peer.socket.recv(2048), time.monotonic()
        if answer[7:10] == b"\xfa\0\0" and (asked := sent.pop(int.from_bytes(answer[10:18], "little"), None)):
            delays.append(1e6 * (now - asked))

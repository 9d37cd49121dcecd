"""What recording costs: two daemons answer the same samples over loopback, one of them with --record.

And what it costs the loop alone: the same turns without a socket, a companion with a recorder and one without in turn.
"""

import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import common as mav

from bench._peers import HEARTBEAT, Peer, _line_with, _running, free_port, imu, paper_design, target
from dob_companion.artifact import DobDesign, dumps
from dob_companion.companion import Companion
from dob_companion.files.recorder import FlightRecorder
from dob_companion.flightlog.witness import Witness

SAMPLES = int(os.environ.get("BENCH_SAMPLES", "5000"))
WARM_UP = 500
DT_S, DT_US = 0.004, 4000
AN_HOUR = 3600 / DT_S


def measure() -> Iterator[str]:
    """Medians with and without, their ratio; bytes an hour; what a checkpoint and the scribe take."""
    design = paper_design()
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        yield from _of_the_loop(directory / "loop", design)
        yield from _over_loopback(directory, design)


def _of_the_loop(directory: Path, design: DobDesign) -> Iterator[str]:
    plain, recorded = Companion(design), Companion(design)
    recorder = FlightRecorder(directory, recorded, design, now=time.monotonic())
    out, rng = mav.MAVLink(None, srcSystem=1, srcComponent=1), np.random.default_rng(1)
    begin = bytes(HEARTBEAT.pack(out))
    pairs = ((plain, Witness(), []), (recorded, recorder, []))
    for companion, witness, _ in pairs:
        _turn(companion, witness, begin)
    for k in range(-WARM_UP, SAMPLES):
        stamp, rates = (k + WARM_UP + 1) * DT_US, rng.normal(0.0, 1e-3, 3)
        question = bytes(imu(stamp, rates).pack(out)), bytes(target(stamp).pack(out))
        for companion, witness, times in pairs if k % 2 else reversed(pairs):
            took = [_turn(companion, witness, data) for data in question]
            if k >= 0:
                times.append(sum(took))
        time.sleep(0.001)  # as in flight, the scribe has time to follow
    without, with_it = (1e6 * np.array(times) for _, _, times in pairs)
    checkpoint = min(_checkpoint(recorder, recorded) for _ in range(20))
    recorder.close()
    load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    yield f"two turns of the loop, one sample; {SAMPLES} samples, {load}"
    yield f"{'µs':24}{'median':>9}{'p99':>9}"
    for what, times in (("without a recorder", without), ("with a recorder", with_it)):
        yield f"{what:24}{np.median(times):>9.1f}{np.percentile(times, 99):>9.1f}"
    extra = np.median(with_it) - np.median(without)
    yield f"with / without {np.median(with_it) / np.median(without):.3f}, {extra / 2:+.1f} µs a turn (ratio of medians)"
    yield f"a checkpoint, each 20 s, after the answers have left: {1e3 * checkpoint:.1f} ms"
    yield f"lost {recorder.lost} turns"


def _turn(companion: Companion, witness: Witness, data: bytes) -> float:
    """One turn as `runtime.daemon` makes it, without the socket. Returns how long it took, s."""
    now = time.monotonic()
    begin = time.perf_counter()
    companion.receive(data, now)
    witness.received(data, now)
    if said := companion.bytes_to_send():
        witness.said(said)
    companion.advance(now)
    witness.advanced(now)
    if said := companion.bytes_to_send():
        witness.said(said)
    for event in companion.events():
        witness.event(event)
    witness.turned(companion, now, 1e-4)
    return time.perf_counter() - begin


def _checkpoint(recorder: FlightRecorder, companion: Companion) -> float:
    begin = time.perf_counter()
    recorder._checkpoint(companion, time.monotonic())
    return time.perf_counter() - begin


def _over_loopback(directory: Path, design: DobDesign) -> Iterator[str]:
    path, flights = directory / "design.json", directory / "flights"
    path.write_text(dumps(design)[0], encoding="utf-8")
    with ExitStack() as stack:
        plain = stack.enter_context(_daemon(path))
        recorded = stack.enter_context(_daemon(path, "--record", str(flights)))
        _fly(plain, recorded, 0, WARM_UP)
        before, cpu = _sizes(flights), recorded.cpu_s() - plain.cpu_s()
        without, with_it = _fly(plain, recorded, WARM_UP, SAMPLES)
        cpu = recorded.cpu_s() - plain.cpu_s() - cpu
        after = _sizes(flights)
    yield f"gyro in to correction out over loopback at 250 Hz, both daemons each 4 ms; {SAMPLES} samples"
    yield f"{'µs':24}{'median':>9}{'p99':>9}{'worst':>9}"
    for what, times in (("without --record", without), ("with --record", with_it)):
        yield f"{what:24}{np.median(times):>9.0f}{np.percentile(times, 99):>9.0f}{times.max():>9.0f}"
    yield f"with / without {np.median(with_it) / np.median(without):.3f} (ratio of medians)"
    yield f"daemon: {cpu / (SAMPLES * DT_S):+.1%} of one core"
    hour = [(b - a) / SAMPLES * AN_HOUR / 1e6 for a, b in zip(before, after, strict=True)]
    yield f"trace {hour[0]:.0f} MB/h, .tlog {hour[1]:.0f} MB/h"


def _daemon(design: Path, *more: str) -> AbstractContextManager[Peer]:
    port = free_port()
    command = [sys.executable, "-m", "dob_companion", "run", "--design", str(design)]
    command += ["--link", f"udpin:127.0.0.1:{port}", *more]
    return _running(command, lambda process: _line_with(process.stderr, "listening") and port)


def _fly(plain: Peer, recorded: Peer, first: int, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Microseconds from question to answer of each, one sample to both every 4 ms."""
    rng, times = np.random.default_rng(first), np.empty((samples, 2))
    start = time.monotonic()
    for k in range(samples):
        stamp, rates = (first + k + 1) * DT_US, rng.normal(0.0, 1e-3, 3)
        time.sleep(max(0.0, start + k * DT_S - time.monotonic()))
        for i, peer in ((0, plain), (1, recorded)) if k % 2 else ((1, recorded), (0, plain)):
            peer.drain()
            if k % 250 == 0:
                peer.send(HEARTBEAT)
            times[k, i] = peer.ask(bytes(imu(stamp, rates).pack(peer.out)), stamp)
            peer.send(target(stamp))
    return times[:, 0], times[:, 1]


def _sizes(flights: Path) -> tuple[int, int]:
    """Bytes of all traces and of all logs."""
    trace, log = (sum(p.stat().st_size for p in flights.glob(f"*.{kind}")) for kind in ("dobtrace", "tlog"))
    return trace, log

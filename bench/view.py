"""What being watched costs: two daemons answer the same samples over loopback, one with live view and status page.

The watched one draws on a terminal that nobody reads and serves nearly as many streams as it allows; half of these take
nothing. An answer is late when it takes longer than a sample. The sender asks for real-time priority, so that what it
sees is the daemon and not its own waiting for a processor.
"""

import contextlib
import json
import os
import pty
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from bench._peers import HEARTBEAT, Peer, companion, free_port, imu, paper_design, target
from dob_companion.runtime.priority import real_time
from dob_companion.view.page import MOST_STREAMS

SAMPLES = int(os.environ.get("BENCH_SAMPLES", "5000"))
WARM_UP = 500
DT_S, DT_US = 0.004, 4000


def measure() -> Iterator[str]:
    """Median, 99th percentile, worst and late answers of both, a sample each in turn."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        alone = stack.enter_context(companion(Path(name), paper_design()))
        watched, page = stack.enter_context(_watched(Path(name) / "design.json"))
        stack.enter_context(real_time())
        times: tuple[list[float], list[float]] = [], []
        begin = time.monotonic()
        for k in range(-WARM_UP, SAMPLES):
            stamp = (k + WARM_UP + 1) * DT_US
            time.sleep(max(0.0, begin + (k + WARM_UP) * DT_S - time.monotonic()))
            peers = (alone, watched), times
            for peer, took in list(zip(*peers, strict=True))[:: 1 if k % 2 else -1]:
                peer.drain()
                if k % 250 == 0:
                    peer.send(HEARTBEAT)
                answer = peer.ask(bytes(imu(stamp, np.zeros(3)).pack(peer.out)), stamp)
                peer.send(target(stamp))
                if k >= 0:
                    took.append(answer)
        late_turns = _late_turns(page)
        load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, {watched.scheduling()} scheduling"
    yield f"{SAMPLES} samples; {load}; {MOST_STREAMS - 1} streams"
    yield f"{'µs':24}{'median':>9}{'p99':>9}{'worst':>9}{'late':>7}"
    for what, values in zip(("alone", "watched"), map(np.array, times), strict=True):
        late = int(np.sum(values > DT_US))
        yield f"{what:24}{np.median(values):>9.0f}{np.percentile(values, 99):>9.0f}{values.max():>9.0f}{late:>7}"
    yield f"turns of the watched loop above a sample, by its own count: {late_turns}"
    yield f"{'ratio of medians':24}{np.median(times[1]) / np.median(times[0]):>9.2f}"


@contextlib.contextmanager
def _watched(design: Path) -> Iterator[tuple[Peer, int]]:
    """`dob-companion run --status-page` on a terminal that nobody reads, with all the readers that a page may have."""
    port, page = free_port(), _free_tcp_port()
    master, slave = pty.openpty()
    command = [sys.executable, "-m", "dob_companion", "run", "--design", str(design)]
    command += ["--link", f"udpin:127.0.0.1:{port}", "--status-page", str(page)]
    with ExitStack() as stack:
        process = subprocess.Popen(command, stderr=slave, text=True, env=os.environ | {"TERM": "xterm-256color"})
        stack.callback(process.wait)
        stack.callback(process.terminate)
        seen = b""
        while b"listening on" not in seen:
            seen += os.read(master, 4096)
        readers = [sys.executable, "-m", "bench._readers", str(page), str(MOST_STREAMS - 1)]
        reading = subprocess.Popen(readers, stdout=subprocess.PIPE)
        stack.callback(reading.wait)
        stack.callback(reading.terminate)
        assert reading.stdout is not None
        reading.stdout.readline()
        yield Peer(process, port), page
    os.close(slave)
    os.close(master)


def _late_turns(page: int) -> int:
    """Turns of the watched loop that took longer than a sample, by its own count."""
    with socket.create_connection(("127.0.0.1", page)) as reader, reader.makefile("rb") as lines:
        reader.sendall(b"GET /feed HTTP/1.1\r\nHost: localhost\r\n\r\n")
        moments = (json.loads(line[6:])["moment"] for line in lines if line.startswith(b'data: {"moment"'))
        return int(next(moment["late_turns"] for moment in moments if moment["at"] > time.time() - 1.0))


def _free_tcp_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port: int = probe.getsockname()[1]
        return port

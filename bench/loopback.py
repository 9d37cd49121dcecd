"""Gyro message in to correction out over loopback UDP at 250 Hz, beside bare echoes and MAVSDK's raw messages.

All answer within the same 4 ms, a quarter of it each, to the same sender: the companion, a bare echo in C, one in
Python (what the language costs before anything is computed), MAVSDK. The time from sending to having the answer
includes two passes of the kernel and the sender's own waking; the noise of the machine's scheduler is measured by that
sender as well, as how late it wakes from its sleeps. The sender is Python, which adds the same few microseconds to
each. Where the daemon gets real-time scheduling the sender gets it before all others: an autopilot does not wait for
the companion's computer.
"""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import common as mav

from bench._peers import HEARTBEAT, Peer, c_echo, companion, imu, mavsdk, paper_design, python_echo, target
from dob_companion.runtime.priority import PRIORITY, real_time

SAMPLES = int(os.environ.get("BENCH_SAMPLES", "5000"))
WARM_UP = 1_000
DT_S, DT_US = 0.004, 4000
C_ECHO, PYTHON_ECHO = "bare echo in C", "bare echo in Python"


def measure() -> Iterator[str]:
    """Median, 99th percentile and worst of each, ratios, and what the daemon uses of the computer."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        daemon = stack.enter_context(companion(Path(name), paper_design()))
        echo = stack.enter_context(c_echo(Path(name)))
        slow_echo = stack.enter_context(python_echo())
        sdk = stack.enter_context(mavsdk())
        for rival in filter(None, (echo, slow_echo, sdk)):
            rival.schedule_like(daemon)
        stack.enter_context(real_time(PRIORITY + 1))
        flight = _Flight(daemon, {C_ECHO: echo, PYTHON_ECHO: slow_echo}, sdk)
        load_before = os.getloadavg()[0]
        flight.fly(WARM_UP)
        daemon.send(mav.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9))
        flight.fly(WARM_UP // 4)
        cpu, memory, begin = daemon.cpu_s(), daemon.memory_kib(), time.monotonic()
        times = flight.fly(SAMPLES)
        share = (daemon.cpu_s() - cpu) / (time.monotonic() - begin)
        growth = daemon.memory_kib() - memory
        yield (
            f"{SAMPLES} samples; load {load_before:.1f} before, {os.getloadavg()[0]:.1f} after, on {os.cpu_count()} "
            f"cores; {daemon.scheduling()} scheduling"
        )
        yield f"{'µs':24}{'median':>9}{'p99':>9}{'worst':>9}"
        if echo is None:
            yield f"{C_ECHO}: skipped, there is no C compiler"
        for what, values in times.items():
            if len(values):
                yield f"{what:24}{np.median(values):>9.0f}{np.percentile(values, 99):>9.0f}{values.max():>9.0f}"
        ours = np.median(times["companion"])
        for what in (C_ECHO, PYTHON_ECHO, "MAVSDK"):
            if len(times[what]):
                yield f"{f'companion / {what}':31}{ours / np.median(times[what]):>7.2f}  (ratio of medians)"
        yield f"companion uses {share:.1%} of one core; resident memory {memory / 1024:.1f} MiB, grew by {growth} KiB"
        yield f"its state was {flight.state()}"


class _Flight:
    """The vehicle's end: every 4 ms one sample to the companion, one to each echo, one to MAVSDK."""

    def __init__(self, daemon: Peer, echoes: dict[str, Peer | None], sdk: Peer) -> None:
        self._daemon, self._echoes, self._sdk = daemon, echoes, sdk
        self._rng = np.random.default_rng(1)
        self._k = 0
        self._ear = mav.MAVLink(None)
        self._ear.robust_parsing = True

    def fly(self, samples: int) -> dict[str, np.ndarray]:
        found: dict[str, list[float]] = {
            "companion": [], C_ECHO: [], PYTHON_ECHO: [], "MAVSDK": [], "waking from sleep": [],
        }  # fmt: skip
        start = time.monotonic()
        for k in range(samples):
            self._k += 1
            stamp = self._k * DT_US
            question = imu(stamp, self._rng.normal(0.0, 1e-3, 3))
            begin = start + k * DT_S
            found["waking from sleep"].append(_sleep_until(begin))
            self._daemon.drain()
            if self._k % 250 == 1:
                self._daemon.send(HEARTBEAT)
                self._sdk.send(HEARTBEAT)
            asked = bytes(question.pack(self._daemon.out))
            found["companion"].append(self._daemon.ask(asked, stamp))
            self._daemon.send(target(stamp))
            for quarter, (what, echo) in enumerate(self._echoes.items(), start=1):
                if echo:
                    found["waking from sleep"].append(_sleep_until(begin + quarter * DT_S / 4))
                    found[what].append(echo.echo(asked))
            found["waking from sleep"].append(_sleep_until(begin + 3 * DT_S / 4))
            self._sdk.drain()
            found["MAVSDK"].append(self._sdk.ask(bytes(question.pack(self._sdk.out)), stamp))
        return {what: np.array(values) for what, values in found.items()}

    def state(self) -> str:
        """The companion's state as it says itself."""
        self._daemon.send(mav.MAVLink_param_request_read_message(1, 191, b"DOB_STATE", -1))
        while True:
            for message in self._ear.parse_buffer(self._daemon.socket.recv(2048)) or []:
                if message.get_type() == "PARAM_VALUE" and message.param_id == "DOB_STATE":
                    return "ACTIVE" if message.param_value == 4.0 else f"{message.param_value:g}, not ACTIVE"


def _sleep_until(moment: float) -> float:
    """Sleep; microseconds too late, 0 where the moment had passed before."""
    left = moment - time.monotonic()
    if left <= 0.0:
        return 0.0
    time.sleep(left)
    return max(0.0, (time.monotonic() - moment) * 1e6)

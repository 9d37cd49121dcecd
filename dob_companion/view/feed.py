"""The feed: what the loop hands to the processes that show it. A line of JSON into a pipe, or a drop; never a wait.

A line is one object with one key:

    {"daemon": {…}}                            once, first: who flies what
    {"event": text, "severity": …, "at": s}    as it happens
    {"moment": {…}}                            ten times a second

Processes and not threads, since drawing takes milliseconds in which a thread would hold the loop's interpreter lock.
"""

import contextlib
import json
import math
import os
import select
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from importlib.util import find_spec
from typing import Any

from dob_companion import __version__
from dob_companion.artifact import AXES, DobDesign
from dob_companion.companion import PARAMETERS, Companion, Event, Status
from dob_companion.errors import LinkBusyError
from dob_companion.files.pipe import ProcessPipe
from dob_companion.flightlog.witness import Witness
from dob_companion.mavlink import Severity

_PIPE_BYTES = 1 << 16
_PATIENCE_S = 1.0


class LoopClock(Witness):
    """How the loop does, counted in the loop."""

    def __init__(self, dt: float) -> None:
        self.late = 0
        """turns that took longer than a sample"""
        self._dt = dt
        self._longest_s = 0.0
        self._cpu = time.process_time(), time.monotonic()

    def turned(self, companion: Companion, now: float, took_s: float) -> str:  # noqa: ARG002
        """Count."""
        self._longest_s = max(self._longest_s, took_s)
        self.late += took_s > self._dt
        return ""

    def take(self) -> dict[str, float]:
        """The longest turn and the share of one core since the last call, and all late turns."""
        longest, self._longest_s = self._longest_s, 0.0
        (cpu, wall), self._cpu = self._cpu, (time.process_time(), time.monotonic())
        share = (self._cpu[0] - cpu) / max(self._cpu[1] - wall, 1e-3)
        return {"longest_turn_s": longest, "late_turns": self.late, "cpu": share}


class Viewer:
    """One process that shows the feed. What it does not take in time is dropped; dropped events are counted.

    When it dies it is not started again, since a process is not started beside a loop in flight; `instead` says what
    there is in its place.
    """

    def __init__(self, name: str, pipe: ProcessPipe, instead: str) -> None:
        self.name = name
        self.instead = instead
        self.pipe = pipe
        self._left_out = 0

    def show(self, line: bytes) -> bool:
        """Hand over a line that only counts while it is new. Returns whether anybody took it."""
        return self.pipe.send(line)

    def tell(self, line: bytes) -> bool:
        """Hand over an event."""
        if self._left_out:
            note = Event(Severity.WARNING, f"{self.name}: {self._left_out} events were not taken in time")
            line = event_record(note) + line
        if self.pipe.send(line):
            self._left_out = 0
            return True
        self._left_out += 1
        return False


class Feed:
    """Everybody who watches one daemon. `say` prints an event where no terminal viewer shows it."""

    def __init__(self, say: Callable[[Event], None]) -> None:
        self._say = say
        self._terminal: Viewer | None = None
        self._viewers: list[Viewer] = []

    @property
    def watched(self) -> bool:
        """Whether anybody watches besides the log."""
        return bool(self._viewers)

    def open_terminal(self) -> None:
        """Show the live view on the terminal that standard error is."""
        pipe = ProcessPipe("dob_companion.view.terminal", size=_PIPE_BYTES)
        self._terminal = Viewer("live view", pipe, "plain lines from here; the loop goes on")
        self._viewers.append(self._terminal)

    def open_page(self, port: int) -> str:
        """Serve the status page on loopback, port 0 for any; returns its address.

        Raises LinkBusyError when the port cannot be had.
        """
        try:
            listener = socket.create_server(("127.0.0.1", port))
        except OSError as problem:
            raise LinkBusyError(f"--status-page {port}: cannot be served on 127.0.0.1: {problem.strerror}") from None
        with listener:
            pipe = ProcessPipe(
                "dob_companion.view.page", [str(listener.fileno())], size=_PIPE_BYTES, keep=[listener.fileno()]
            )
            self._viewers.append(Viewer("status page", pipe, "no page until the next start; the loop goes on"))
            return f"http://127.0.0.1:{listener.getsockname()[1]}/"

    def introduce(self, design: DobDesign, link: str) -> None:
        """Say who flies what."""
        line = _record({"daemon": _introduction(design, link)})
        for viewer in self._viewers:
            viewer.show(line)

    def event(self, event: Event) -> None:
        """Something happened."""
        line = event_record(event)
        for viewer in self._viewers:
            viewer.tell(line)
        if self._terminal is None or self._terminal.pipe.broken:
            self._say(event)
        self._mourn()

    def moment(self, companion: Companion, status: Status, clock: LoopClock) -> None:
        """How things stand now."""
        if self._viewers:
            line = _record({"moment": _moment(companion, status, clock)})
            for viewer in self._viewers:
                viewer.show(line)
            self._mourn()

    def close(self) -> None:
        """Let everybody finish; waits for a second each at most."""
        for viewer in self._viewers:
            viewer.pipe.close(_PATIENCE_S)
        self._viewers = []

    def _mourn(self) -> None:
        gone = [viewer for viewer in self._viewers if viewer.pipe.broken]
        self._viewers = [viewer for viewer in self._viewers if not viewer.pipe.broken]
        for viewer in gone:
            viewer.pipe.close(0.0)
            if viewer is self._terminal:
                _show_cursor()
            self.event(Event(Severity.WARNING, f"{viewer.name}: its process has ended, {viewer.instead}"))


def live_view_fits() -> bool:
    """Whether standard error is a terminal that can move its cursor, and the extra `[view]` is there to draw on it."""
    return sys.stderr.isatty() and os.environ.get("TERM", "dumb") != "dumb" and find_spec("rich") is not None


def _show_cursor() -> None:
    """The live view hides the cursor; killed, it cannot show it again."""
    with contextlib.suppress(OSError):
        if select.select([], [sys.stderr], [], 0.0)[1]:
            os.write(sys.stderr.fileno(), b"\x1b[?25h")


def event_record(event: Event) -> bytes:
    """An event as a line of the feed."""
    return _record({"event": event.text, "severity": event.severity.name, "at": time.time()})


def _record(content: dict[str, Any]) -> bytes:
    return json.dumps(content, separators=(",", ":")).encode() + b"\n"


def _introduction(design: DobDesign, link: str) -> dict[str, Any]:
    return {
        "version": __version__,
        "design": design.sha256[:8],
        "axes": list(AXES),
        "dt": design.dt,
        "delay_samples": design.delay_samples,
        "link": link,
    }


def _moment(companion: Companion, status: Status, clock: LoopClock) -> dict[str, Any]:
    moment: dict[str, Any] = asdict(status) | clock.take() | {"state": status.state.name, "at": time.time()}
    moment["vehicle"] = companion.vehicle
    moment["parameters"] = {spec.name: companion.parameters[spec.name] for spec in PARAMETERS if not spec.read_only}
    return {name: _spoken(value) for name, value in moment.items()}


def _spoken(value: Any) -> Any:
    """Numbers that are not finite become null: a browser's JSON has no other word for them."""
    if isinstance(value, tuple):
        return [_spoken(each) for each in value]
    if isinstance(value, float):
        return round(value, 6) if math.isfinite(value) else None
    return value

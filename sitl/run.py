"""The two loops that own clock and sockets: real time and lockstep."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

from sitl.autopilot.vehicle import START_US
from sitl.constants import DT_US
from sitl.errors import FlightFailedError
from sitl.links import Link, wait
from sitl.pace import Pace
from sitl.priority import RealTime
from sitl.scenario.script import Phase
from sitl.wire.endpoint import COMPANION, GROUND, Endpoint

REPEAT_S = 0.2
"""In lockstep, and while the clock stands, the newest pair is sent again after this much wall time."""

SILENCE_S = 5.0
"""A companion that was there and has been silent this long in lockstep ends the flight."""

SERVE_S = 0.02
"""Longest wait for bytes, so that heartbeats and streams leave in time."""

LAST_ANSWER_S = 0.1
"""In real time the last sample's answer is waited for this long: as long as a correction would be held."""

STATUS_S = 5.0

REMIND_S = 2.0
"""In lockstep, a companion that is not there is asked for after this much wall time, and again each STATUS_S."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Patience in wall seconds: for the companion's first answer (lockstep), and for each awaited event."""

    companion: float | None = None
    event: float | None = 60.0


class Loop:
    """What both clocks share: serving the links, saying what happens, and losing patience."""

    def __init__(
        self, endpoint: Endpoint, links: dict[str, Link], limits: Limits, ends: dict[str, str] | None = None
    ) -> None:
        """`ends` are the URLs by which others meet us on these links, for the words of who waits."""
        self.endpoint, self.links, self.limits = endpoint, links, limits
        self._ends = ends or {}
        self.flight = endpoint.flight
        self.stopped = False
        self.interrupted = False
        self._awaiting: str | None = None
        self._awaiting_since = 0.0
        self._next_status = monotonic() + STATUS_S

    def stop(self, interrupted: bool = False) -> None:
        """End the flight at the next opportunity; called from signal handlers."""
        self.stopped, self.interrupted = True, interrupted

    @property
    def running(self) -> bool:
        """Neither complete nor stopped."""
        return not self.stopped and not self.flight.complete

    def step(self) -> None:
        """Fly one sample and send its pair."""
        for text in self.endpoint.step():
            say(text)
        self.flush()

    def flush(self) -> None:
        """Send everything queued."""
        for name, link in self.links.items():
            for datagram in self.endpoint.bytes_to_send(name):
                link.send(datagram)

    def finish(self) -> None:
        """Announce the end; by now the files are whole."""
        say("flight complete")
        self.endpoint.notice("flight complete")
        self.flush()

    def serve(self, until: float) -> None:
        """Wait for bytes until `until` (wall, s) at most, take them in, and send what is due."""
        now = monotonic()
        for name, data in wait(self.links, min(until - now, SERVE_S)):
            self.endpoint.receive(name, data)
        now = monotonic()
        self.endpoint.advance(now)
        self.flush()
        self._watch(now)

    def ask_for_companion(self) -> None:
        """Say that nobody answers, and what to type."""
        say(f"waiting for a companion: dob-companion run --design FILE --link {self._end(COMPANION)}")

    def _end(self, name: str) -> str:
        return self._ends.get(name, "URL")

    def _watch(self, now: float) -> None:
        awaiting = self.flight.script.awaiting
        if awaiting != self._awaiting:
            self._awaiting, self._awaiting_since = awaiting, now
            if awaiting:
                how = f": dob-companion param set DOB_ENABLE 1 --link {self._end(GROUND)}"
                say(f"waiting for {awaiting}{how if awaiting == Phase.WAIT_OBSERVER.value else ''}")
        patience = self.limits.event
        if awaiting and patience is not None and now - self._awaiting_since > patience:
            raise FlightFailedError(f"nothing came for {patience:g} s; expected {awaiting} from the ground station")
        if self.flight.script.phase is Phase.HOVER and now >= self._next_status:
            self._next_status = now + STATUS_S
            say(self._status())

    def _status(self) -> str:
        newest, vehicle = self.flight.newest, self.flight.vehicle
        age = newest.age if newest else -1
        heard = f"companion {age} samples behind" if age >= 0 else "companion silent"
        seconds = vehicle.now_us * 1e-6
        return f"{seconds:.0f} s  altitude {vehicle.airframe.altitude:.2f} m  {heard}  garbage {self.endpoint.bad}"


def fly_real_time(loop: Loop) -> int:
    """Fly on the wall clock until complete or stopped; returns the number of overruns. Raises FlightFailedError."""
    with RealTime(say).taken() as real_time:
        pace = Pace(DT_US * 1e-6, monotonic())
        while loop.running:
            now = monotonic()
            if now < pace.due:
                loop.serve(pace.due)
                continue
            loop.serve(now)  # answers that have arrived by now act in this sample
            loop.step()
            pace.flown(now)
            real_time.keep()
        last_call = monotonic() + LAST_ANSWER_S
        while not loop.stopped and not loop.endpoint.newest_answered and monotonic() < last_call:
            loop.serve(last_call)
    return pace.overruns


def fly_lockstep(loop: Loop) -> int:
    """Fly as fast as the companion answers until complete or stopped; no overruns. Raises FlightFailedError."""
    endpoint, script = loop.endpoint, loop.flight.script
    while loop.running:
        loop.step()
        _until(loop, lambda: endpoint.newest_answered, _first_patience(loop), waits_for_companion=_at_first(loop))
        if loop.running and script.awaiting:
            _until(loop, lambda: script.awaiting is None, None)
    return 0


def _at_first(loop: Loop) -> bool:
    return loop.flight.vehicle.now_us == START_US


def _first_patience(loop: Loop) -> float | None:
    """Sample 0 repeats until the companion is there."""
    return loop.limits.companion if _at_first(loop) else SILENCE_S


def _until(loop: Loop, done: Callable[[], bool], patience: float | None, *, waits_for_companion: bool = False) -> None:
    """Serve the links until `done`, repeating the newest pair; FlightFailedError after `patience` seconds."""
    began = monotonic()
    repeat = began + REPEAT_S
    remind = began + REMIND_S if waits_for_companion else float("inf")
    while not loop.stopped and not done():
        loop.serve(repeat)
        now = monotonic()
        if now >= repeat and not done():
            loop.endpoint.repeat()
            loop.flush()
            repeat = now + REPEAT_S
            if now >= remind:
                remind = now + STATUS_S
                loop.ask_for_companion()
            if patience is not None and now - began > patience:
                k = (loop.flight.vehicle.now_us - START_US) // DT_US
                raise FlightFailedError(f"no answer to sample {k} for {patience:g} s; expected one from component 191")


def say(text: str) -> None:
    """One line for the person at the terminal."""
    print(f"sitl: {text}", file=sys.stderr, flush=True)

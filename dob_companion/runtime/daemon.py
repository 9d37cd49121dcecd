"""The daemon's loop: one thread, one link, one blocking wait. It owns the clock and the signals."""

import contextlib
import select
import signal
import socket
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from dob_companion.companion import Companion, Event
from dob_companion.errors import NoVehicleError
from dob_companion.flightlog.witness import Witness
from dob_companion.mavlink import ComputerLoad, Severity
from dob_companion.runtime.links import Link
from dob_companion.runtime.priority import Warden, real_time
from dob_companion.runtime.rehearsal import Rehearsal
from dob_companion.runtime.witnesses import Witnesses

EXIT_INTERRUPTED = 130
LONGEST_WAIT_S = 0.2
"""So that a lost connection is noticed and opened again even when nothing else is due."""

FULL_LINE_WAIT_S = 0.01
"""The longest wait while something is still to be sent."""

READING_S = 0.004
"""Time to read in one turn, a sample's: a flood must not keep the companion from its deadlines."""

MOST_BYTES = 8192
"""Read in one turn at most: 0.09 s of a full line at 921600 baud. A vehicle whose samples have waited
for longer has timed out, and is answered with zeros."""

STATUS_EVERY_S = 0.1
"""Between two pictures of the moment for whoever watches."""

_LOAD_EVERY_S = 1.0

_ENDING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


class Stop:
    """SIGTERM, Ctrl-C and a closed terminal as something to wait on: the wait ends at once, the loop decides."""

    def __init__(self) -> None:
        self._wake, self._woken = socket.socketpair()
        for end in (self._wake, self._woken):
            end.setblocking(False)
        self.signal: int | None = None

    def fileno(self) -> int:
        """A descriptor that becomes readable when a signal has come."""
        return self._wake.fileno()

    @contextlib.contextmanager
    def installed(self) -> Iterator["Stop"]:
        """Take the ending signals over; give them back at the end.

        SIGHUP stays ignored where it was, by `nohup`. SIGINT does not: a shell has it ignored for whatever it starts
        in the background, and who sends it all the same means it.
        """
        before = {number: signal.signal(number, self._note) for number in _ENDING if not _hangup_ignored(number)}
        wakeup = signal.set_wakeup_fd(self._woken.fileno(), warn_on_full_buffer=False)
        try:
            yield self
        finally:
            signal.set_wakeup_fd(wakeup)
            for number, handler in before.items():
                signal.signal(number, handler)
            self._wake.close()
            self._woken.close()

    def drain(self) -> None:
        """Take note that the wait has ended, so that the next one waits again."""
        with contextlib.suppress(BlockingIOError):
            self._wake.recv(64)

    def _note(self, number: int, _frame: object) -> None:
        self.signal = self.signal or number


def _hangup_ignored(number: int) -> bool:
    return number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN


def serve(
    companion: Companion,
    link: Link,
    *,
    ready: str = "serving",
    timeout_s: float | None = None,
    witnesses: Iterable[Witness] = (),
) -> int:
    """Say `ready`, then serve one companion on one link until SIGTERM (returns 0) or Ctrl-C (returns 130).

    Both end with the fade and the zero of docs/interfaces.md. The witnesses are told in their order; one that raises
    is left out from then on. Raises NoVehicleError when `timeout_s` passes without a vehicle's heartbeat.
    """
    started = time.monotonic()
    give_up_at = started + timeout_s if timeout_s is not None else float("inf")
    next_status = next_load = started
    witness = Witnesses(witnesses)
    with real_time() as scheduling, Stop().installed() as stop, Warden(scheduling, started).on_duty() as warden:
        witness.event(Event.info(scheduling.words))
        rehearsal = Rehearsal(companion) if scheduling.granted else None
        witness.event(Event.info(ready))  # only now does a signal end in a fade
        while not companion.closed:
            now = time.monotonic()
            witness.begins(companion, now)
            if stop.signal is not None:
                companion.close(now)
                witness.closing(now)
            if companion.vehicle is None and now >= give_up_at:
                raise NoVehicleError(f"no vehicle was heard within {timeout_s:g} s")
            if now >= next_load:
                companion.load, next_load = _load(now - started), now + _LOAD_EVERY_S
                witness.loaded(companion.load)
            if witness.watch and now >= next_status:
                witness.status(companion, companion.status())
                next_status = now + STATUS_EVERY_S
            until = min(next_status if witness.watch else now + LONGEST_WAIT_S, give_up_at)
            woke = _turn(companion, link, stop, witness, rehearsal if scheduling.real_time else None, until)
            took = time.monotonic() - woke
            for event in [*companion.events(), *link.events()]:
                witness.event(event)
            for trouble in filter(None, (*witness.turned(companion, woke, took), warden.turned(woke + took))):
                witness.event(Event(Severity.WARNING, trouble))
    return EXIT_INTERRUPTED if stop.signal == signal.SIGINT else 0


def _turn(
    companion: Companion, link: Link, stop: Stop, witness: Witnesses, rehearsal: Rehearsal | None, until: float
) -> float:
    """Wait for the link, a signal or a deadline; then let the companion work and send what it says.

    Returns when the wait ended.
    """
    now = time.monotonic()
    until = min(companion.next_deadline(), until, now + (FULL_LINE_WAIT_S if link.flush() else LONGEST_WAIT_S))
    ends = [end for end in (link, stop) if end.fileno() >= 0]
    ready: list[Link | Stop] = []
    if rehearsal and now < rehearsal.due < until:
        ready = _ready(ends, rehearsal.due)
        if not ready:
            rehearsal.run()
    ready = ready or _ready(ends, until)
    now = time.monotonic()
    ready = ready or _ready(ends, now)  # what came while this process was held up is not missing
    if stop in ready:
        stop.drain()
    if link in ready:
        batch = _batch(link, now + READING_S)
        newest = _last(map(companion.may_bring_sample, batch))
        for number, data in enumerate(batch):
            companion.receive(data, now)
            witness.received(data, now)
            if number >= newest:
                _flush(companion, link, witness)
            if rehearsal:
                rehearsal.heard(data, now)
    companion.advance(now)
    witness.advanced(now)
    _flush(companion, link, witness)
    return now


def pieces(link: Link, until: float) -> Iterator[bytes]:
    """What has come in, at least a piece, but none after `until`."""
    while (data := link.read()) is not None:
        yield data
        if time.monotonic() >= until:
            return


def _batch(link: Link, until: float) -> list[bytes]:
    """What is there before any of it is looked at, so that of a backlog the newest sample is known."""
    found, size = [], 0
    for data in pieces(link, until):
        found.append(data)
        size += len(data)
        if size >= MOST_BYTES:
            break
    return found


def _last(found: Iterable[bool]) -> int:
    """The index of the last True; 0 where there is none."""
    return max((number for number, true in enumerate(found) if true), default=0)


def _ready(ends: list[Link | Stop], until: float) -> list[Link | Stop]:
    """Wait for one of the ends; those that have something to say."""
    ready, _, _ = select.select(ends, [], [], max(0.0, until - time.monotonic()))
    return ready


def _flush(companion: Companion, link: Link, witness: Witnesses) -> None:
    messages = companion.bytes_to_send()
    if messages:
        witness.said(messages)
        link.write(*messages)


def _load(uptime_s: float) -> ComputerLoad:
    """Memory of this computer; zeros where /proc does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return ComputerLoad(round(1e3 * uptime_s))
    kib = {name: int(rest.split()[0]) for name, _, rest in (line.partition(":") for line in lines)}
    total, free = kib.get("MemTotal", 0), kib.get("MemAvailable", 0)
    return ComputerLoad(round(1e3 * uptime_s), (total - free) // 1024, total // 1024)

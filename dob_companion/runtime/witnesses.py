"""The witnesses of a flight as one; a mistake in one of them costs that witness, never the flight."""

import contextlib
import os
import select
import sys
from collections.abc import Callable, Iterable, Sequence

from dob_companion.companion import Companion, Event, Status
from dob_companion.flightlog.witness import Witness
from dob_companion.mavlink import ComputerLoad, Severity


class Witnesses:
    """Tells each witness in turn, with the calls of `Witness`.

    An exception that one of them lets out is a mistake of this program. It must not end a flight without a fade, so it
    is caught here and nowhere else: it is said once, and that witness is told nothing any more.
    """

    def __init__(self, witnesses: Iterable[Witness]) -> None:
        self._kept = list(witnesses)

    @property
    def watch(self) -> bool:
        """Whether any of them wants `status`."""
        return any(witness.watches for witness in self._kept)

    def begins(self, companion: Companion, now: float) -> None:
        """A turn begins."""
        self._tell(lambda witness: witness.begins(companion, now))

    def received(self, data: bytes, now: float) -> None:
        """`Companion.receive` was called."""
        self._tell(lambda witness: witness.received(data, now))

    def advanced(self, now: float) -> None:
        """`Companion.advance` was called."""
        self._tell(lambda witness: witness.advanced(now))

    def closing(self, now: float) -> None:
        """`Companion.close` was called."""
        self._tell(lambda witness: witness.closing(now))

    def loaded(self, load: ComputerLoad) -> None:
        """`Companion.load` was set."""
        self._tell(lambda witness: witness.loaded(load))

    def said(self, messages: Sequence[bytes]) -> None:
        """The companion answered."""
        self._tell(lambda witness: witness.said(messages))

    def event(self, event: Event) -> None:
        """There is something to tell."""
        self._tell(lambda witness: witness.event(event))

    def status(self, companion: Companion, status: Status) -> None:
        """How things stand."""
        self._tell(lambda witness: witness.status(companion, status))

    def turned(self, companion: Companion, now: float, took_s: float) -> list[str]:
        """A turn is over. Returns what the operator should hear."""
        troubles: list[str] = []
        self._tell(lambda witness: troubles.append(witness.turned(companion, now, took_s)))
        return [trouble for trouble in troubles if trouble]

    def _tell(self, call: Callable[[Witness], None]) -> None:
        for witness in tuple(self._kept):
            try:
                call(witness)
            except Exception as problem:  # whatever it is: see above
                self._drop(witness, problem)

    def _drop(self, witness: Witness, problem: Exception) -> None:
        if witness not in self._kept:  # it was told of somebody else's mistake meanwhile, and made another
            return
        self._kept.remove(witness)
        words = " ".join(f"{type(problem).__name__}: {problem}".split())
        text = f"{type(witness).__name__.lstrip('_')} has failed and is left out, the flight goes on: {words}"
        if type(witness).event is not Witness.event:  # it may have been the log itself
            _last_word(text)
        self.event(Event(Severity.WARNING, text))


def _last_word(text: str) -> None:
    """One line on standard error, unless nobody takes what stands there already."""
    with contextlib.suppress(OSError, ValueError):
        if select.select([], [sys.stderr], [], 0.0)[1]:
            os.write(sys.stderr.fileno(), f"{text}\n".encode())

"""The next answer rehearsed: shortly before a sample is expected, a twin of the companion answers the one before.

In the milliseconds between two samples the computer does much else, or its neighbours on the same chip do, and the code
that answers a sample has left the processor's caches when it is wanted again: most of an answer's time then goes into
fetching it (`python -m bench step` measures that). The twin runs the same code on what the companion has heard, so
that the code is there in time. What the twin says goes nowhere, and nothing leads from it to the companion.
"""

from collections import deque

from dob_companion.companion import Companion

LEAD_S = 0.00035
"""How long before a sample is expected its rehearsal begins: long enough for it to be over, no longer, lest the caches
are lost again."""

MOST_PIECES = 16
"""Pieces rehearsed at once, the newest: a flood makes the twin forgetful, not the loop late."""


class Rehearsal:
    """The twin of a companion that has heard nothing yet."""

    def __init__(self, companion: Companion) -> None:
        self._companion = companion
        self._twin = companion.newborn()
        self._expected = companion.next_sample
        self._programme: deque[tuple[bytes, float]] = deque(maxlen=MOST_PIECES)
        self._later: deque[tuple[bytes, float]] = deque(maxlen=MOST_PIECES)

    @property
    def due(self) -> float:
        """When to rehearse the next sample."""
        return self._expected - LEAD_S

    def heard(self, data: bytes, now: float) -> None:
        """The companion has received this. What follows a sample waits, so that a rehearsal ends with an answer."""
        self._later.append((data, now))
        if self._companion.next_sample != self._expected:
            self._expected = self._companion.next_sample
            self._programme.extend(self._later)
            self._later.clear()

    def run(self) -> None:
        """Let the twin answer."""
        while self._programme:
            self._twin.receive(*self._programme.popleft())
        self._twin.bytes_to_send()
        self._twin.events()

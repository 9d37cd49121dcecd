"""What every link shares: an outbox in front of the line, and words about what becomes of it."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable

from dob_companion.companion import Event
from dob_companion.mavlink import Severity
from dob_companion.runtime.outbox import Outbox
from dob_companion.runtime.urls import LinkUrl

TELL_EVERY_S = 10.0
"""Wall time between two lines about a line that is full."""


class OutgoingLink(ABC):
    """The writing half of a link. Whoever derives from it knows the line: see its abstract
    methods."""

    def __init__(self, url: LinkUrl, waiting_bytes: int) -> None:
        self._url = url
        self._outbox = Outbox(waiting_bytes)
        self._events: list[Event] = []
        self._told, self._tell_at = 0, 0.0

    def write(self, *messages: bytes) -> None:
        """Send messages in order. What the line does not take waits, the newest correction first, or is dropped."""
        if not messages or not self._up():
            return
        try:
            room = self._room()
            for message in messages:
                self._outbox.put(message)
                room -= self._outbox.flush(self._send, room)
        except OSError as problem:
            self._fail(problem)

    def flush(self) -> bool:
        """Send what waits, as far as the line takes it; whether something still waits."""
        if not self._outbox:
            return False
        try:
            self._outbox.flush(self._send, self._room())
        except OSError as problem:
            self._fail(problem)
        return bool(self._outbox)

    def seal_with(self, seal: Callable[[bytes], bytes]) -> None:
        """Let each message pass through `seal` when its turn to leave has come."""
        self._outbox.seal = seal

    def events(self) -> list[Event]:
        """What the operator should hear of the line since the last call."""
        now, lost = time.monotonic(), self._outbox.dropped + self._outbox.overtaken
        if lost > self._told and now >= self._tell_at:
            self._told, self._tell_at = lost, now + TELL_EVERY_S
            self._warn(
                f"the line is full: corrections overtaken by newer ones: {self._outbox.overtaken}, "
                f"other messages dropped: {self._outbox.dropped}"
            )
        events, self._events = self._events, []
        return events

    def _say(self, text: str) -> None:
        self._events.append(Event.info(f"{self._url}: {text}"))

    def _warn(self, text: str) -> None:
        self._events.append(Event(Severity.WARNING, f"{self._url}: {text}"))

    @abstractmethod
    def _up(self) -> bool:
        """Whether there is a line."""

    @abstractmethod
    def _room(self) -> int:
        """Bytes that it may be given now."""

    @abstractmethod
    def _send(self, data: bytes) -> int:
        """Give it some; returns how many it took."""

    @abstractmethod
    def _fail(self, problem: OSError) -> None:
        """Let go of a line that raised."""

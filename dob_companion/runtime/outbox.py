"""What waits for a line that takes less than it is given. Pure: the link that owns it does the writing.

A message goes out whole or not at all: one that the line has taken a part of is finished before anything else. A
correction is void when a newer one exists, so only the newest waits, and it goes before other messages, though never
twice in a row while another waits: a slow line must not cost the operator his echo. Of the others the oldest are
dropped when more wait than `most_bytes`.
"""

from collections import deque
from collections.abc import Callable

from dob_companion.mavlink import is_correction


def as_it_is(message: bytes) -> bytes:
    """The seal of a link that signs nothing."""
    return message


class Outbox:
    """`seal` is applied to a message when its turn has come, since signatures count in the order of sending."""

    def __init__(self, most_bytes: int) -> None:
        self.seal: Callable[[bytes], bytes] = as_it_is
        self.dropped = 0
        """other messages that there was no room for"""
        self.overtaken = 0
        """corrections that a newer one has replaced before they had left"""
        self._most_bytes = most_bytes
        self._begun = b""
        self._correction: bytes | None = None
        self._others: deque[bytes] = deque()
        self._waiting = 0
        self._others_turn = False

    def __bool__(self) -> bool:
        """Whether anything waits."""
        return bool(self._begun or self._correction or self._others)

    def put(self, message: bytes) -> None:
        """A message is to go out."""
        if is_correction(message):
            self.overtaken += self._correction is not None
            self._correction = message
            return
        self._others.append(message)
        self._waiting += len(message)
        while self._waiting > self._most_bytes and len(self._others) > 1:
            self._waiting -= len(self._others.popleft())
            self.dropped += 1

    def flush(self, write: Callable[[bytes], int], room: int) -> int:
        """Hand messages to `write`, which returns how many bytes the line has taken, until it is full, `room` bytes
        are used up (by the last message they may be exceeded) or nothing waits. Returns the bytes taken."""
        taken = 0
        while taken < room and self:
            data = self._begun or self.seal(self._first())
            count = write(data)
            if count and not self._begun:
                self._remove_first()
            if count:
                self._begun = data[count:]
            taken += count
            if count < len(data):
                break
        return taken

    def clear(self) -> None:
        """The line is another one now: nothing that waited for the old is of use."""
        self._begun, self._correction, self._waiting = b"", None, 0
        self._others.clear()

    def _first(self) -> bytes:
        if self._correction is None or (self._others_turn and self._others):
            return self._others[0]
        return self._correction

    def _remove_first(self) -> None:
        if self._correction is None or (self._others_turn and self._others):
            self._waiting -= len(self._others.popleft())
            self._others_turn = False
        else:
            self._correction, self._others_turn = None, True

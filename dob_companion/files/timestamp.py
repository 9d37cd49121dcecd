"""The newest signing timestamp on disk, so that it never runs backwards over a restart."""

from pathlib import Path

from dob_companion.errors import InputError
from dob_companion.files.atomic import read_text
from dob_companion.files.background_writer import BackgroundWriter

NAME = "signing-timestamp"
EVERY_S = 30.0
"""Wall time between two writes."""

AHEAD = 3_500_000
"""Added to what is read, in ticks of 10 µs: 35 s, more than can have passed since the last write, and well within the
minute by which the clock of a peer not heard before may lag ours."""


def recover_timestamp(directory: Path) -> int:
    """Where to go on from; 0 when nothing usable is there, and the clock alone decides."""
    try:
        text = read_text(directory / NAME).strip()
    except InputError:
        return 0
    return int(text) + AHEAD if text.isascii() and text.isdigit() and len(text) <= 15 else 0


class TimestampKeeper:
    """Hands the timestamp to a `BackgroundWriter` now and then."""

    def __init__(self, writer: BackgroundWriter) -> None:
        self._writer = writer
        self._next = float("-inf")

    def keep(self, now: float, timestamp: int) -> None:
        """Called in every turn of the loop."""
        if now >= self._next:
            self._next = now + EVERY_S
            self._writer.put(f"{timestamp}\n")

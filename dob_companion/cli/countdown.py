"""How long a command of some seconds may still take, on the line of `console.progress`."""

import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from dob_companion.cli.console import progress

TICK_S = 1.0


class Countdown:
    """What is at work and about how long it has left, once a second; the estimate follows what the work has taken.

    As a context it ends with a clear line.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic, show: Callable[[str], None] = progress) -> None:
        self._clock, self._show = clock, show
        self._text, self._begun, self._expected_s = "", clock(), 0.0
        self._over = threading.Event()

    def __enter__(self) -> Self:
        threading.Thread(target=self._tick, daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._over.set()
        self._show("")

    def say(self, text: str) -> None:
        """Say what is at work."""
        self._text = text
        self._show(self.line())

    def begin(self, expected_s: float) -> None:
        """Begin work that takes about so long."""
        self._begun, self._expected_s = self._clock(), expected_s

    def done(self, share: float) -> None:
        """So much of the work has been done."""
        self._expected_s = (self._clock() - self._begun) / share

    def line(self) -> str:
        """What is shown now."""
        left = self._expected_s - (self._clock() - self._begun)
        if not self._expected_s or not self._text:
            return self._text
        return f"{self._text}, {f'about {left:.0f} s left' if left >= 1.0 else 'nearly done'}"

    def _tick(self) -> None:
        while not self._over.wait(TICK_S):
            self._show(self.line())

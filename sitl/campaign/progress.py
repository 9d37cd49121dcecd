"""How far it is and how long it takes, on a terminal; nothing in a pipe."""

import sys
from time import monotonic


class Progress:
    """One line that is written over; `done` flights were there before."""

    def __init__(self, total: int, done: int) -> None:
        self._total, self._before, self._done = total, done, done
        self._began = monotonic()
        self._shown = sys.stderr.isatty()

    def add(self, flights: int) -> None:
        """So many more are done."""
        self._done += flights
        if self._shown:
            print(f"\r\x1b[K{self.line()}", end="", file=sys.stderr, flush=True)

    def line(self) -> str:
        """What there is to say."""
        flown, elapsed = self._done - self._before, monotonic() - self._began
        text = f"{self._done} of {self._total} flights, {100 * self._done // self._total} %"
        if flown:
            text += f", {flown / elapsed:.1f}/s, {_clock((self._total - self._done) * elapsed / flown)} left"
        return text

    def clear(self) -> None:
        """Leave the line to others."""
        if self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"

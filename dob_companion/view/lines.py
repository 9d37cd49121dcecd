"""Log lines for a stream that may stop taking any: a terminal held with Ctrl-S, a pipe that nobody reads."""

import select
import time
from typing import TextIO


def event_line(unix_s: float, severity: str, text: str) -> str:
    """One event as people read it; `unix_s` is shown as local time of day."""
    return f"{time.strftime('%H:%M:%S', time.localtime(unix_s))} {severity.lower():8} {text}"


class Lines:
    """Writes whole lines, or leaves them out and says so later: whoever writes never waits.

    A pipe that is ready takes PIPE_BUF (4096) bytes at once (pipe(7)), more than any line here.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._left_out = 0

    def write(self, line: str) -> None:
        """Write one line, if the stream is ready for it."""
        if not select.select([], [self._stream], [], 0.0)[1]:
            self._left_out += 1
            return
        if self._left_out:
            line, self._left_out = f"({self._left_out} lines left out)\n{line}", 0
        print(line, file=self._stream, flush=True)

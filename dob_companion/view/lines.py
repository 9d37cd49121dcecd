"""Log lines for a stream that may stop taking any: a terminal held with Ctrl-S, a pipe nobody reads, a full disk."""

import time
from typing import TextIO

from dob_companion.view.outlet import Outlet


def event_line(unix_s: float, severity: str, text: str) -> str:
    """One event as people read it; `unix_s` is shown as local time of day."""
    return f"{time.strftime('%H:%M:%S', time.localtime(unix_s))} {severity.lower():8} {text}"


def duration(seconds: float) -> str:
    """`15 s`, `4 min`, `2 h`: as exact as anybody wants to know for how long nothing was heard."""
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.0f} h"


class Lines:
    """Writes whole lines, or leaves them out and says so later: whoever writes never waits, and nothing is raised."""

    def __init__(self, stream: TextIO) -> None:
        self.left_out = 0
        """lines so far"""
        self._untold = 0
        self._encoding = stream.encoding or "utf-8"
        stream.flush()
        self._outlet = Outlet(stream.fileno())

    def write(self, line: str) -> None:
        """Write one line, if the stream takes it."""
        told = f"({self._untold} lines left out)\n" if self._untold else ""
        if self._outlet.send(f"{told}{line}\n".encode(self._encoding, "backslashreplace")):
            self._untold = 0
        else:
            self._untold += 1
            self.left_out += 1

    def close(self) -> None:
        """Wait a moment for what is on its way."""
        self._outlet.close()

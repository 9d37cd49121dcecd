"""The reading end of the feed, in the process that shows it. Standard library only."""

import contextlib
import os
import select
import signal
from collections.abc import Iterator

_PIECE = 1 << 16


def stand_back() -> None:
    """Leave the computer to the loop: ordinary scheduling, low priority. Signals are the daemon's: we end with it."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        os.nice(10)


def batches(every_s: float, fd: int = 0) -> Iterator[list[bytes]]:
    """Lines as they come, all that are there at once; an empty list after `every_s` without. Ends with the input."""
    rest = b""
    while True:
        if not select.select([fd], [], [], every_s)[0]:
            yield []
            continue
        piece = os.read(fd, _PIECE)
        if not piece:
            return
        *lines, rest = (rest + piece).split(b"\n")
        yield lines

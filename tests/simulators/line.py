"""A serial line between an autopilot and its companion: two pseudo-terminals, and a process that carries the bytes.

A pseudo-terminal has no speed of its own; the autopilot's simulator has (SIM_BAUDLIMIT_EN). Bytes that nobody takes are
lost, as on a line without flow control.
"""

import contextlib
import multiprocessing
import os
import select
import tty
from collections.abc import Iterator

from tests.simulators.relay import PRIORITY

AT_ONCE = 4096


@contextlib.contextmanager
def line() -> Iterator[tuple[str, str]]:
    """The devices at both ends."""
    ends = [os.openpty(), os.openpty()]
    masters = [master for master, _ in ends]
    for master, slave in ends:
        tty.setraw(slave)
        os.set_blocking(master, False)
    process = multiprocessing.get_context("fork").Process(target=_carry, args=masters, daemon=True)
    process.start()
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(process.pid or 0, os.SCHED_RR, os.sched_param(PRIORITY))
    try:
        yield os.ttyname(ends[0][1]), os.ttyname(ends[1][1])
    finally:
        process.terminate()
        process.join(5)
        for fd in [fd for end in ends for fd in end]:
            os.close(fd)


def _carry(one: int, other: int) -> None:
    while True:
        ready, _, _ = select.select([one, other], [], [])
        for end in ready:
            with contextlib.suppress(BlockingIOError):
                os.write(other if end == one else one, os.read(end, AT_ONCE))

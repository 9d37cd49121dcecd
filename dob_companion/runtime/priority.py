"""Real-time scheduling for the loop that answers the aircraft, where the system grants it."""

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass

PRIORITY = 20
"""SCHED_FIFO priority, 1…99: above every ordinary process, below the kernel's own threads (50)."""


@dataclass(frozen=True, slots=True)
class Scheduling:
    """How the system schedules the loop, and that in words."""

    real_time: bool
    words: str


@contextlib.contextmanager
def real_time(priority: int = PRIORITY) -> Iterator[Scheduling]:
    """Run with SCHED_FIFO if that is allowed (root, CAP_SYS_NICE or LimitRTPRIO), and give it back at the end.

    Yields what was got. On a busy computer an ordinary process waits for milliseconds until it runs; each
    4 ms cost one sample of delay.
    """
    before, parameter = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        yield Scheduling(False, "ordinary scheduling (real-time priority is not granted)")
        return
    try:
        yield Scheduling(True, f"real-time scheduling (SCHED_FIFO {priority})")
    finally:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, before, parameter)

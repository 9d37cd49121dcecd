"""Real-time scheduling for the loop that answers the aircraft, where the system grants it and while it is in order."""

import contextlib
import os
import resource
import signal
import time
from collections.abc import Iterator

from dob_companion.runtime.leash import Leash

PRIORITY = 20
"""SCHED_FIFO priority, 1…99: above every ordinary process, below the kernel's own threads (50)."""

LONGEST_RUN_S = 0.2
"""Processor time without a pause after which the kernel itself says so (RLIMIT_RTTIME): a turn that does not end."""


class Scheduling:
    """How the system schedules the loop, and that in words."""

    def __init__(self, priority: int) -> None:
        self._before = os.sched_getscheduler(0), os.sched_getparam(0)
        self._priority = priority
        self.real_time = False
        self.granted = self.take()
        self.words = (
            f"real-time scheduling (SCHED_FIFO {priority})"
            if self.granted
            else "ordinary scheduling (real-time priority is not granted)"
        )

    def take(self) -> bool:
        """Ask for SCHED_FIFO; whether that is allowed (root, CAP_SYS_NICE or LimitRTPRIO)."""
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(self._priority))
            self.real_time = True
        return self.real_time

    def give_back(self) -> None:
        """Be scheduled as before."""
        if self.real_time:
            self.real_time = False
            with contextlib.suppress(OSError):
                os.sched_setscheduler(0, *self._before)


@contextlib.contextmanager
def real_time(priority: int = PRIORITY) -> Iterator[Scheduling]:
    """Run with SCHED_FIFO if that is allowed, and give it back at the end. Yields what was got.

    On a busy computer an ordinary process waits for milliseconds until it runs; each 4 ms cost one sample of delay.
    """
    scheduling = Scheduling(priority)
    try:
        yield scheduling
    finally:
        scheduling.give_back()


class Warden:
    """Holds `scheduling` to what its leash allows. Lives in the main thread, where signals arrive."""

    def __init__(self, scheduling: Scheduling, now: float) -> None:
        self._scheduling = scheduling
        self._leash = Leash(now, time.thread_time())
        self._overran = False

    @contextlib.contextmanager
    def on_duty(self) -> Iterator["Warden"]:
        """Let the kernel stop a run without a pause even in the middle of a turn."""
        if not self._scheduling.granted:
            yield self
            return
        handler, limits = signal.signal(signal.SIGXCPU, self._stop_run), resource.getrlimit(resource.RLIMIT_RTTIME)
        self._limit_run()
        try:
            yield self
        finally:
            _set_limits(*limits)
            signal.signal(signal.SIGXCPU, handler)

    def turned(self, now: float) -> str:
        """A turn of the loop is over: judge, act, and return what has been done in words, or ""."""
        if not self._scheduling.granted or (now < self._leash.due and not self._overran):
            return ""
        words = ""
        if self._overran:
            self._overran = False
            words = self._leash.overran(now, LONGEST_RUN_S)
        words = words or self._leash.look(now, time.thread_time())
        if self._leash.granted != self._scheduling.real_time:
            if self._leash.granted:
                self._scheduling.take()
                self._limit_run()
            else:
                self._scheduling.give_back()
        return words

    def _stop_run(self, _number: int, _frame: object) -> None:
        self._scheduling.give_back()
        self._overran = True

    def _limit_run(self) -> None:
        """Set anew each time: the kernel raises the limit by a second whenever it has been reached."""
        _, hard = resource.getrlimit(resource.RLIMIT_RTTIME)
        longest = round(1e6 * LONGEST_RUN_S)
        _set_limits(longest if hard == resource.RLIM_INFINITY else min(longest, hard // 2), hard)


def _set_limits(soft: int, hard: int) -> None:
    with contextlib.suppress(OSError, ValueError):  # without it the leash is looked at once a turn still
        resource.setrlimit(resource.RLIMIT_RTTIME, (soft, hard))

"""Real-time scheduling for a clock that runs with the wall's, on a leash."""

import contextlib
import os
import resource
import signal
from collections.abc import Callable, Iterator
from time import monotonic

REAL_TIME_PRIORITY = 21
"""SCHED_FIFO priority where it is granted: an autopilot's clock does not wait its turn."""

LONGEST_RUN_S = 0.2
"""Processor time without a pause after which the priority is given up: a vehicle that cannot fly as fast as time, or is
flooded, would keep everything else of the computer from running."""

CALM_S = 1.0
"""Wall time after which it is asked for again."""


class RealTime:
    """SCHED_FIFO where that is allowed, until a run without a pause. `say` is told of the first."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._before = os.sched_getscheduler(0), os.sched_getparam(0)
        self._given_up_at: float | None = None
        self._told = False

    @contextlib.contextmanager
    def taken(self) -> Iterator["RealTime"]:
        """Ask for it now, and give it back at the end."""
        limits = resource.getrlimit(resource.RLIMIT_RTTIME)
        handler = signal.signal(signal.SIGXCPU, self._give_up)
        self._take()
        try:
            yield self
        finally:
            self._give_back()
            _limit(*limits)
            signal.signal(signal.SIGXCPU, handler)

    def keep(self) -> None:
        """Called now and then: ask again for what was given up."""
        if self._given_up_at is None or monotonic() < self._given_up_at + CALM_S:
            return
        self._given_up_at = None
        self._take()
        if not self._told:
            self._told = True
            self._say(f"flew {LONGEST_RUN_S:g} s without a pause, so real-time priority was off for {CALM_S:g} s")

    def _take(self) -> None:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(REAL_TIME_PRIORITY))
        _, hard = resource.getrlimit(resource.RLIMIT_RTTIME)
        longest = round(1e6 * LONGEST_RUN_S)
        _limit(longest if hard == resource.RLIM_INFINITY else min(longest, hard // 2), hard)  # SIGXCPU comes after it

    def _give_up(self, *_: object) -> None:
        self._give_back()
        self._given_up_at = monotonic()

    def _give_back(self) -> None:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, *self._before)


def _limit(soft: int, hard: int) -> None:
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_RTTIME, (soft, hard))

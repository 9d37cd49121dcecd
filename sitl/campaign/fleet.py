"""Processes of this computer that fly: jobs in, rows out as they are done, in any order.

A job is handed out only when somebody is about to fly it, so that losing a process costs at most a few flights begun
again.
"""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait

from sitl.campaign.pilot import Job, Row, fly_row
from sitl.errors import SitlError

AHEAD = 2
"""Jobs in flight per worker: one that flies, one that waits."""

MOST_LOSSES = 3
"""A pool of processes that dies so often without a single row is not the fault of chance."""


class FleetError(SitlError):
    """The workers are gone; what they have flown is kept."""


def local(jobs: Iterable[Job], processes: int) -> Iterator[list[Row]]:
    """Fly on `processes` processes of this computer. A process that dies is replaced and its flight flown again.

    Raises FleetError when processes keep dying.
    """
    left, losses = deque(jobs), 0
    while left:
        under_way: dict[Future[Row], Job] = {}
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(min(processes, len(left)), mp_context=context, initializer=_begin_worker)
        try:
            for rows in _flow(pool, left, under_way, AHEAD * processes):
                losses = 0
                yield rows
        except BrokenExecutor:
            losses += 1
            if losses >= MOST_LOSSES:
                numbers = ", ".join(str(job.inputs.flight) for job in under_way.values())
                raise FleetError(f"worker processes died {losses} times in a row, with flights {numbers}") from None
            left.extendleft(under_way.values())
        finally:
            pool.shutdown(cancel_futures=True)


def _flow(
    pool: ProcessPoolExecutor, left: deque[Job], under_way: dict[Future[Row], Job], most: int
) -> Iterator[list[Row]]:
    while left or under_way:
        while left and len(under_way) < most:
            job = left.popleft()
            try:
                under_way[pool.submit(fly_row, job)] = job
            except BrokenExecutor:
                left.appendleft(job)
                raise
        done, _ = wait(under_way, return_when=FIRST_COMPLETED)
        whole = [future for future in done if not isinstance(future.exception(), BrokenExecutor)]
        rows = [future.result() for future in whole]
        for future in whole:
            del under_way[future]
        if rows:
            yield rows
        if len(whole) < len(done):
            raise BrokenExecutor


def _begin_worker() -> None:
    """A worker leaves with its parent, whichever way that goes."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_leave_with, args=(parent.join,), daemon=True).start()


def _leave_with(join: Callable[[], None]) -> None:
    join()
    os._exit(1)

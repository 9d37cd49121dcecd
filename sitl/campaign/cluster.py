"""Workers of a Dask cluster that fly: jobs in, rows out as they are done, in any order.

Jobs travel by value and are handed out only when a worker is about to fly them. So workers may come and go: the
scheduler gives the jobs of a lost one to others, and what is known of a job is never on one worker alone.
"""

import logging
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import distributed

from sitl.campaign.fleet import AHEAD, FleetError
from sitl.campaign.pilot import Job, Row, fly_row
from sitl.errors import InputError

POLL_S = 2.0
"""At least so often it is seen whether workers have come or gone."""

CONNECT_S = 10


def cluster(jobs: Iterable[Job], address: str, say: Callable[[str], None]) -> Iterator[list[Row]]:
    """Fly on the workers of the Dask scheduler at `address`; `say` hears when there are none.

    Raises InputError when there is no scheduler, FleetError when it is lost or workers keep dying on one flight.
    """
    for name in [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what is lost is ours to report, in one line
    connect: Any = distributed.Client
    try:
        client = connect(address, timeout=CONNECT_S)
    except (OSError, ValueError) as error:
        raise InputError(f"--scheduler {address}: no Dask scheduler answers: {error}") from None
    with client:
        yield from _flow(client, deque(jobs), address, say)


def _flow(client: Any, left: deque[Job], address: str, say: Callable[[str], None]) -> Iterator[list[Row]]:
    wait: Any = distributed.wait
    under_way: dict[Any, Job] = {}
    alone = False
    while left or under_way:
        workers = _workers(client, address)
        if not workers and not alone:
            say(f"no workers at {address}; waiting for some")
        alone = not workers
        while left and len(under_way) < AHEAD * max(workers, 1):
            job = left.popleft()
            under_way[client.submit(fly_row, job, pure=False)] = job
        try:
            done = wait(list(under_way), timeout=POLL_S, return_when="FIRST_COMPLETED").done
            rows = [future.result() for future in done]
        except TimeoutError:
            continue
        except distributed.CancelledError:
            raise FleetError(f"the scheduler at {address} is gone; the same command goes on from here") from None
        except distributed.KilledWorker as error:
            raise FleetError(f"workers keep dying on one flight: {error}") from None
        for future in done:
            del under_way[future]
        yield rows


def _workers(client: Any, address: str) -> int:
    """Threads of all workers that are there."""
    try:
        return sum(client.nthreads().values())
    except (OSError, ValueError):
        raise FleetError(f"the scheduler at {address} is gone; the same command goes on from here") from None

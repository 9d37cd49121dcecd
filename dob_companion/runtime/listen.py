"""Driving a `Listening` on a link: the clock and the waiting."""

import itertools
import select
import time
from collections.abc import Callable

from dob_companion.companion.listening import Listening, Stage
from dob_companion.runtime.daemon import LONGEST_WAIT_S, MOST_READS
from dob_companion.runtime.links import Link


def listen(listening: Listening, link: Link, on_stage: Callable[[Stage], None]) -> None:
    """Let it listen until it is done; `on_stage` hears of each stage as it begins."""
    stage = None
    while True:
        now = time.monotonic()
        wait = max(0.0, min(listening.next_deadline() - now, LONGEST_WAIT_S))
        ends = [link] if link.fileno() >= 0 else []
        ready, _, _ = select.select(ends, [], [], wait)
        for _ in ready:
            for data in itertools.islice(iter(link.read, None), MOST_READS):
                listening.receive(data, time.monotonic())
        listening.advance(time.monotonic())
        for message in listening.bytes_to_send():
            link.write(message)
        if listening.stage is not stage:
            stage = listening.stage
            on_stage(stage)
        if stage is Stage.DONE:
            return

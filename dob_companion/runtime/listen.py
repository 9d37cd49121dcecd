"""Driving a `Listening` on a link: the clock and the waiting."""

import select
import time
from collections.abc import Callable

from dob_companion.companion import Event
from dob_companion.doctor.listening import Listening, Stage
from dob_companion.runtime.daemon import FULL_LINE_WAIT_S, LONGEST_WAIT_S, READING_S, pieces
from dob_companion.runtime.links import Link


def listen(
    listening: Listening, link: Link, on_stage: Callable[[Stage], None], on_event: Callable[[Event], None]
) -> None:
    """Let it listen until it is done; `on_stage` hears of each stage as it begins, `on_event` of the link."""
    stage = None
    while True:
        now = time.monotonic()
        wait = max(0.0, min(listening.next_deadline() - now, FULL_LINE_WAIT_S if link.flush() else LONGEST_WAIT_S))
        ends = [link] if link.fileno() >= 0 else []
        ready, _, _ = select.select(ends, [], [], wait)
        for _ in ready:
            for data in pieces(link, time.monotonic() + READING_S):
                listening.receive(data, time.monotonic())
        listening.advance(time.monotonic())
        link.write(*listening.bytes_to_send())
        for event in link.events():
            on_event(event)
        if listening.stage is not stage:
            stage = listening.stage
            on_stage(stage)
        if stage is Stage.DONE:
            return

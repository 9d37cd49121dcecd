"""One turn of the loop that was held up by a busy computer."""

import contextlib
import time

from dob_companion.companion import Companion
from dob_companion.runtime import daemon
from dob_companion.runtime.witnesses import Witnesses
from tests.companion.aircraft import Aircraft, small_design
from tests.runtime.test_links import udpin


def test_what_came_in_while_the_loop_was_held_up_after_its_wait_is_not_missing(monkeypatch):
    companion, looked, ready = Companion(small_design()), [], daemon._ready

    def held_up(ends, until):
        """The wait ends with nothing; by the time that the loop goes on, something has come."""
        looked.append(until)
        return ready(ends, until) if len(looked) > 1 else []

    monkeypatch.setattr(daemon, "_ready", held_up)
    beat = bytes(Aircraft(companion).imu().pack(Aircraft(companion).out))
    stop = daemon.Stop()
    with udpin() as (link, send, _), contextlib.closing(stop._wake), contextlib.closing(stop._woken):
        send(beat)
        daemon._turn(companion, link, stop, Witnesses([]), None, time.monotonic())
    assert len(looked) == 2
    assert companion.status().foreign == 1  # heard: of a vehicle that it has not met

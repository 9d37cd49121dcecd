"""The loop's end of the feed: whatever the viewers do, it goes on at once."""

import math
import os
import signal
import socket
from dataclasses import replace

import pytest

from dob_companion.companion import Companion, Event
from dob_companion.errors import LinkBusyError
from dob_companion.view.feed import Feed, LoopClock
from tests.companion.aircraft import DT, small_design
from tests.view.watching import get, stream

MANY = 5_000
"""Moments of more than half a kilobyte: dozens of times what a pipe takes."""


@pytest.fixture
def companion():
    return Companion(small_design())


@pytest.fixture
def watched():
    """A feed with a status page; yields feed, port, process id of the page, and what was said without a viewer."""
    said = []
    feed = Feed(lambda event: said.append(event.text))
    port = int(feed.open_page(0).rstrip("/").rpartition(":")[2])
    feed.introduce(small_design(), "udpin:127.0.0.1:14540")
    (viewer,) = feed._viewers
    yield feed, port, viewer.pipe.pid, said
    feed.close()


def test_a_viewer_that_stands_still_loses_moments_and_holds_nothing_up(watched, companion):
    feed, port, pid, _ = watched
    os.kill(pid, signal.SIGSTOP)
    clock = LoopClock(DT)
    for k in range(MANY):  # it returns: nothing here waits for the page
        status = replace(companion.status(), stepped=k)
        feed.moment(companion, status, clock)
    for k in range(50):
        feed.event(Event.info(f"event {k}"))
    os.kill(pid, signal.SIGCONT)
    notes, newest = "", -1
    with stream(port) as (_, said):
        while newest < MANY:  # told again until there is room: each turn takes one of the moments that got through
            feed.event(Event.info("again"))
            feed.moment(companion, replace(companion.status(), stepped=MANY), clock)
            while "moment" not in (seen := next(said)):
                notes += str(seen.get("event", ""))
            newest = seen["moment"]["stepped"]
    assert "events were not taken in time" in notes


def test_a_viewer_that_dies_is_reported_once_and_the_log_goes_on(watched, companion):
    feed, _, pid, said = watched
    os.kill(pid, signal.SIGKILL)
    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    for _ in range(3):
        feed.moment(companion, companion.status(), LoopClock(DT))
    feed.event(Event.info("still here"))
    assert said == ["status page: its process has ended, no page until the next start; the loop goes on", "still here"]


def test_numbers_that_are_not_finite_reach_the_page_as_null(watched, companion):
    feed, port, _, _ = watched
    odd = replace(companion.status(), rate_hz=math.inf, d_hat=(math.nan, 0.25, -math.inf))
    feed.moment(companion, odd, LoopClock(DT))
    with stream(port) as (_, said):
        while "moment" not in (seen := next(said)):
            pass
    assert seen["moment"]["d_hat"] == [None, 0.25, None]
    assert seen["moment"]["rate_hz"] is None


def test_turns_that_take_longer_than_a_sample_are_counted(companion):
    clock = LoopClock(DT)
    for took in (0.1 * DT, 0.9 * DT, 1.5 * DT, 0.2 * DT):
        clock.turned(companion, 0.0, took)
    first, second = clock.take(), clock.take()
    assert (first["longest_turn_s"], first["late_turns"]) == (1.5 * DT, 1)
    assert (second["longest_turn_s"], second["late_turns"]) == (0.0, 1)


def test_a_port_in_use_is_an_error_that_names_it():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(LinkBusyError, match=f"--status-page {port}: .*in use"):
            Feed(print).open_page(port)


def test_the_page_ends_with_the_feed_and_frees_its_port(watched):
    feed, port, _, _ = watched
    assert get(port)[0] == 200
    with stream(port) as (_, said):
        feed.close()
        list(said)  # comes to its end
    with pytest.raises(ConnectionRefusedError):
        get(port)


def test_a_signal_of_the_terminal_is_not_for_the_viewers(watched):
    _, port, pid, _ = watched
    assert get(port)[0] == 200
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(pid, number)
    assert get(port)[0] == 200

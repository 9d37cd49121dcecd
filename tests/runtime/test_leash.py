"""Real-time priority is for a loop with time left over."""

import os
import select
import signal
import time

import pytest

from dob_companion.runtime.leash import CALM_S, MOST_SHARE, WINDOW_S, Leash
from dob_companion.runtime.priority import Warden, real_time


class Second:
    """A leash, and a loop whose seconds take a share of a core each."""

    def __init__(self):
        self.now = self.cpu = 0.0
        self.leash = Leash(self.now, self.cpu)
        self.words = []

    def pass_with(self, share, seconds=1.0):
        for _ in range(round(seconds / WINDOW_S)):
            self.now += WINDOW_S
            self.cpu += share * WINDOW_S
            assert self.leash.due <= self.now
            self.words.append(self.leash.look(self.now, self.cpu))
        return self.leash.granted


def test_a_loop_in_order_keeps_real_time_and_nothing_is_said():
    loop = Second()
    assert loop.pass_with(0.9 * MOST_SHARE, seconds=60)
    assert not any(loop.words)


def test_one_second_above_the_share_gives_it_up_and_ten_calm_ones_bring_it_back():
    loop = Second()
    assert not loop.pass_with(0.93)
    assert "93% of a core" in loop.words[-1]
    assert not loop.pass_with(0.1, seconds=CALM_S - WINDOW_S)
    assert loop.pass_with(0.1)
    assert loop.words[-1] == "real-time scheduling again"
    assert sum(map(bool, loop.words)) == 2


def test_calm_is_counted_from_the_last_second_that_was_not():
    loop = Second()
    loop.pass_with(0.9)
    for _ in range(5):
        loop.pass_with(0.1, seconds=CALM_S / 2)
        assert not loop.pass_with(0.9)
    assert sum(map(bool, loop.words)) == 1, "a flood that goes on is said once"


def test_a_run_without_a_pause_gives_it_up_at_once():
    loop = Second()
    assert "0.2 s without a pause" in loop.leash.overran(0.5, 0.2)
    assert not loop.leash.granted
    assert loop.leash.overran(0.7, 0.2) == ""


def test_a_process_that_was_stopped_has_not_overrun():
    loop = Second()
    loop.now += 20.0
    loop.cpu += 1.5 * MOST_SHARE
    assert loop.leash.look(loop.now, loop.cpu) == ""
    assert loop.leash.granted


@pytest.fixture
def warden():
    with real_time() as scheduling:
        if not scheduling.granted:
            pytest.skip("real-time priority is not granted here")
        time.sleep(0.001)  # the kernel counts a run from the last pause
        with Warden(scheduling, time.monotonic()).on_duty() as it:
            yield it
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
    assert signal.getsignal(signal.SIGXCPU) == signal.SIG_DFL


def test_the_kernel_ends_the_priority_of_a_turn_that_does_not_end(warden):
    assert os.sched_getscheduler(0) == os.SCHED_FIFO
    while os.sched_getscheduler(0) == os.SCHED_FIFO:  # a spin: nobody looks at the leash
        pass
    assert "without a pause" in warden.turned(time.monotonic())


def test_a_loop_that_sleeps_keeps_the_priority_however_long_it_goes_on(warden):
    begun = time.thread_time()
    while time.thread_time() - begun < 0.5:  # more than one run may take, in pieces
        rest = time.thread_time()
        while time.thread_time() - rest < 0.01:
            pass
        select.select([], [], [], 0.001)
    assert os.sched_getscheduler(0) == os.SCHED_FIFO

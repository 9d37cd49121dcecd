"""A clock in real time keeps its priority while it has time left over."""

import os
import signal
import time

import pytest

from sitl import priority
from sitl.priority import RealTime


@pytest.mark.skipif(os.geteuid() != 0, reason="real-time priority is not granted here")
def test_a_run_without_a_pause_loses_real_time_for_a_while(monkeypatch):
    monkeypatch.setattr(priority, "CALM_S", 0.0)
    said = []
    with RealTime(said.append).taken() as real_time:
        time.sleep(0.001)  # the kernel counts a run from the last pause
        assert os.sched_getscheduler(0) == os.SCHED_FIFO
        while os.sched_getscheduler(0) == os.SCHED_FIFO:
            pass
        time.sleep(0.001)
        real_time.keep()
        assert os.sched_getscheduler(0) == os.SCHED_FIFO
    assert len(said) == 1
    assert os.sched_getscheduler(0) == os.SCHED_OTHER, "what is drawn and written afterwards has time"
    assert signal.getsignal(signal.SIGXCPU) == signal.SIG_DFL

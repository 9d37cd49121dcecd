"""sd_notify, heard on a real socket as systemd hears it."""

import os
import socket

import pytest

from dob_companion.runtime import Notifier


@pytest.fixture
def manager(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        ear.bind(str(tmp_path / "notify"))
        ear.setblocking(False)
        yield ear


def heard(ear):
    said = []
    while True:
        try:
            said.append(ear.recv(4096).decode())
        except BlockingIOError:
            return said


def environment(ear, **more):
    return {"NOTIFY_SOCKET": ear.getsockname()} | more


def test_the_first_turn_says_ready_and_later_ones_feed_the_watchdog(manager):
    notifier = Notifier.from_environment(environment(manager, WATCHDOG_USEC="2000000"))
    for tick in range(1001):  # four seconds at 250 Hz
        notifier.alive(100.0 + 0.004 * tick, lambda: "ACTIVE, 250 Hz")
    said = heard(manager)
    assert said[0] == "READY=1\nWATCHDOG=1\nSTATUS=ACTIVE, 250 Hz"
    assert set(said[1:]) == {"WATCHDOG=1\nSTATUS=ACTIVE, 250 Hz"}
    assert len(said) == 9  # four in each watchdog period


def test_leaving_is_said(manager):
    Notifier.from_environment(environment(manager)).stopping()
    assert heard(manager) == ["STOPPING=1"]


def test_the_watchdog_of_another_process_does_not_set_our_pace(manager):
    other = environment(manager, WATCHDOG_USEC="40000", WATCHDOG_PID=str(os.getpid() + 1))
    notifier = Notifier.from_environment(other)
    for tick in range(250):
        notifier.alive(0.004 * tick, str)
    assert len(heard(manager)) == 1


def test_an_abstract_socket_is_understood():
    name = f"dob-companion-test-{os.getpid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        ear.bind("\0" + name)
        Notifier("@" + name).alive(0.0, lambda: "ok")
        assert ear.recv(100).startswith(b"READY=1")


def test_without_systemd_or_with_a_dead_one_nothing_happens(tmp_path):
    Notifier.from_environment({}).alive(0.0, str)
    dead = Notifier(str(tmp_path / "nobody"))
    dead.alive(0.0, str)
    dead.stopping()


def test_a_full_queue_is_not_waited_for(manager):
    notifier = Notifier(manager.getsockname())
    for second in range(10_000):  # far more than the kernel queues; returns because nothing blocks
        notifier.alive(2.0 * second, str)
    assert 0 < len(heard(manager)) < 10_000

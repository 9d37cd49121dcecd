"""What every test shares: which of them are slow, and how many examples of a property are tried.

A test is quick until it is found to be slow: `make slow` writes slow.txt anew, a line for each function or, where what
it shares with others takes long to build, for each file, and the seconds that all of it took. `make quick` leaves those
out. The files that take longest begin first, so that no process is left with one at the end.
"""

import os
import signal
from collections import defaultdict
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads only get in each other's way

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as a shell starts what it puts in the background: the
    signal.signal(signal.SIGINT, signal.default_int_handler)  # processes of the tests would inherit a deaf Ctrl-C

_patient = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # a busy machine is no fault
settings.register_profile("proof", _patient, max_examples=100)
settings.register_profile("test", _patient, max_examples=40)
settings.load_profile("test")  # effort.py; `make proof` names the other

SLOW = Path(__file__).with_name("slow.txt")
SLOW_S = 0.25

_took: dict[str, list[float]] = defaultdict(list)


def pytest_addoption(parser):
    parser.addoption("--write-slow", action="store_true", help="write tests/slow.txt anew from this run")


def pytest_collection_modifyitems(items):
    lines = [line.split() for line in SLOW.read_text(encoding="utf-8").splitlines()]
    slow = {name: float(seconds) for seconds, name in lines}
    files: dict[str, float] = defaultdict(float)
    for name, seconds in slow.items():
        files[name.partition("::")[0]] += seconds
    for item in items:
        function, file = item.nodeid.partition("[")[0], item.nodeid.partition("::")[0]
        if slow.keys() & {function, file}:
            item.add_marker(pytest.mark.slow)
    items.sort(key=lambda item: -files[item.nodeid.partition("::")[0]])


def pytest_runtest_logreport(report):
    function, _, _ = report.nodeid.partition("[")
    _took[function.partition("::")[0] if report.when == "setup" else function].append(report.duration)


def pytest_sessionfinish(session):
    if session.config.getoption("--write-slow") and not hasattr(session.config, "workerinput"):
        slow = {name for name, times in _took.items() if max(times) > SLOW_S}
        files = {name for name in slow if "::" not in name}
        kept = sorted(files | {name for name in slow if name.partition("::")[0] not in files})
        lines = [f"{_seconds(name):.1f} {name}\n" for name in kept]
        SLOW.write_text("".join(lines), encoding="utf-8")


def _seconds(name):
    """What a function took altogether, or a file with all that it builds and all of its functions."""
    return sum(sum(took) for other, took in _took.items() if name in (other, other.partition("::")[0]))

"""What every test shares: which of them are slow.

A test is quick until it is found to be slow: `make slow` writes slow.txt anew, one name a line, of a function or, where
what it shares with others takes long to build, of a file. `make quick` leaves those out.
"""

import os
from collections import defaultdict
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads only get in each other's way

SLOW = Path(__file__).with_name("slow.txt")
SLOW_S = 0.4

_took: dict[str, list[float]] = defaultdict(list)


def pytest_addoption(parser):
    parser.addoption("--write-slow", action="store_true", help="write tests/slow.txt anew from this run")


def pytest_collection_modifyitems(items):
    slow = set(SLOW.read_text(encoding="utf-8").split())
    for item in items:
        function, file = item.nodeid.partition("[")[0], item.nodeid.partition("::")[0]
        if slow & {function, file}:
            item.add_marker(pytest.mark.slow)


def pytest_runtest_logreport(report):
    function, _, _ = report.nodeid.partition("[")
    _took[function.partition("::")[0] if report.when == "setup" else function].append(report.duration)


def pytest_sessionfinish(session):
    if session.config.getoption("--write-slow") and not hasattr(session.config, "workerinput"):
        slow = {name for name, times in _took.items() if max(times) > SLOW_S}
        files = {name for name in slow if "::" not in name}
        kept = sorted(files | {name for name in slow if name.partition("::")[0] not in files})
        SLOW.write_text("".join(f"{name}\n" for name in kept), encoding="utf-8")

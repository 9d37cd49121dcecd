"""What takes long to build is built once and read by all processes of pytest-xdist."""

import fcntl
from collections.abc import Callable
from pathlib import Path

import pytest


def built_once(factory: pytest.TempPathFactory, name: str, build: Callable[[Path], None]) -> Path:
    """A directory of this run that `build` has filled, here or in the process that came first."""
    base = factory.getbasetemp()
    directory = (base.parent if base.name.startswith("popen-") else base) / f"shared-{name}"
    directory.mkdir(exist_ok=True)
    with (directory / ".lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (directory / ".built").exists():
            build(directory)
            (directory / ".built").touch()
    return directory

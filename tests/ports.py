"""Ports for the processes of a test to meet on, below those that the system hands out by itself (Linux from 32768):
there any socket that sends without a port of its own may take the one that was just found free.
"""

import itertools
import os
import socket

_FIRST, _EACH = 10_000, 2_000
_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_mine = itertools.cycle(range(_FIRST + _WORKER % 5 * _EACH, _FIRST + (_WORKER % 5 + 1) * _EACH))


def free_port(kind: int = socket.SOCK_DGRAM) -> int:
    """A port on loopback that nobody uses, another one at each call; the processes of pytest-xdist share none."""
    return next(port for port in itertools.islice(_mine, _EACH) if _is_free(port, kind))


def _is_free(port: int, kind: int) -> bool:
    with socket.socket(socket.AF_INET, kind) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True

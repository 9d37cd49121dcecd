"""Child processes that cannot outlive the demo, and free ports for them to meet on."""

import contextlib
import itertools
import os
import random
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

PATIENCE_S = 5.0
"""How long a process may take to fade out and leave before it is killed."""


_PORTS = range(20_000, 32_000)
"""Below those that a system hands out by itself (Linux from 32768), which any socket may take after they were found
free."""


def free_udp_ports(count: int) -> list[int]:
    """Different UDP ports on loopback that nobody uses at the moment."""
    drawn = (port for port in random.sample(_PORTS, len(_PORTS)) if _is_free(port))
    return list(itertools.islice(drawn, count))


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


@contextlib.contextmanager
def child(module: str, arguments: Sequence[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run `python -m module …` with its output in `log`; on leaving, let it end cleanly, else kill it.

    It gets a session of its own: Ctrl-C reaches the demo alone, which then ends its children in order.
    """
    with log.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )
        try:
            yield process
        finally:
            stop(process)


def stop(process: subprocess.Popen[bytes]) -> int:
    """SIGTERM, wait, and only then kill. Returns the exit code."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    try:
        return process.wait(PATIENCE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def last_line(log: Path) -> str:
    """The last line that a process wrote; "" when it wrote nothing."""
    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return lines[-1] if lines else ""

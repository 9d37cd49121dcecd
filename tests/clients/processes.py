"""Companion, vehicle and clients as processes on one machine, each with real sockets."""

import contextlib
import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path

from tests.cli.processes import PATIENCE_S, daemon
from tests.ports import free_port

ROOT = Path(__file__).parents[2]


@contextlib.contextmanager
def process(*arguments, stderr=None):
    """A Python process of ours that ends with the block."""
    running = subprocess.Popen([sys.executable, *map(str, arguments)], cwd=ROOT, stderr=stderr)
    try:
        yield running
    finally:
        running.terminate()
        running.wait(PATIENCE_S)


@contextlib.contextmanager
def flying(design, kind, *more, key=""):
    """A companion beside a vehicle of this kind; gives the port on which a ground station listens."""
    companion, ground = free_port(), free_port()
    vehicle = process("-m", "tests.clients.vehicle", kind, companion, ground, key)
    with daemon(design, companion, *more), vehicle:
        yield ground


class MavProxy:
    """MAVProxy driven through its prompt, as a person does."""

    def __init__(self, master, directory, *more):
        self.lines = queue.SimpleQueue()
        self.seen = []
        self._process = subprocess.Popen(
            [sys.executable, Path(sys.executable).parent / "mavproxy.py", f"--master={master}", *more],
            cwd=directory,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=os.environ | {"HOME": str(directory), "PYTHONUNBUFFERED": "1"},
            text=True,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """The end of its input ends it, or else a kill: on SIGTERM it goes on waiting at its prompt."""
        self._process.stdin.close()
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _read(self):
        for line in self._process.stdout:
            self.lines.put(line.rstrip())

    def type(self, command):
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()

    def wait_for(self, word):
        """The next line that holds the word."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            with contextlib.suppress(queue.Empty):
                line = self.lines.get(timeout=0.1)
                self.seen.append(line)
                if word in line:
                    return line
        raise AssertionError(f"MAVProxy did not say {word!r}: " + "\n".join(self.seen[-20:]))

    def ask(self, command, word):
        """Type a command; the line of its answer."""
        self.type(command)
        return self.wait_for(word)

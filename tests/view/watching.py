"""Watching the real daemon: on a pseudo-terminal, by HTTP, and in a browser driven through its own pipe."""

import contextlib
import fcntl
import http.client
import json
import os
import pty
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import termios
import time

from tests.browser import CHROMIUM, FLAGS
from tests.cli.processes import PATIENCE_S

_FLAGS = (
    *FLAGS,
    "--remote-debugging-pipe",
)
_EXEC = (
    "import os, sys; os.dup2(int(sys.argv[1]), 3); os.dup2(int(sys.argv[2]), 4); os.execv(sys.argv[3], sys.argv[3:])"
)
_CURSOR = re.compile(r"\x1b\[\?25([hl])")
_ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\r")


class Terminal:
    """A pseudo-terminal with a program's standard error on it. What is not read stays there, as after Ctrl-S."""

    def __init__(self, columns=80, rows=24):
        self.master, self.slave = pty.openpty()
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.text = ""
        self.cursor = True

    def close(self):
        os.close(self.master)

    def wait_for(self, pattern):
        """Read until the pattern is there, then forget all up to it; returns the match."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            if found := re.search(pattern, self.text):
                self.text = self.text[found.end() :]
                return found
            self.read(0.1)
        raise AssertionError(f"{pattern!r} not seen in {self.text[-2000:]!r}")

    def read(self, timeout):
        """Take what is there. False at the end, when all that wrote on it have gone."""
        if not select.select([self.master], [], [], timeout)[0]:
            return True
        try:
            piece = os.read(self.master, 65536).decode(errors="replace")
        except OSError:
            return False
        for shown in _CURSOR.findall(piece):
            self.cursor = shown == "h"
        self.text += _ESCAPES.sub("", piece)
        return True


@contextlib.contextmanager
def shown(design, port, *more, columns=80, term="xterm-256color"):
    """`dob-companion run` on a terminal; yields its process and the terminal."""
    terminal = Terminal(columns)
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES", "NO_COLOR")}
    process = subprocess.Popen(
        [sys.executable, "-m", "dob_companion", "run", "--design", design, "--link", f"udpin:127.0.0.1:{port}", *more],
        stderr=terminal.slave,
        stdout=subprocess.DEVNULL,
        env=environment | {"TERM": term},
    )
    os.close(terminal.slave)
    try:
        yield process, terminal
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
        process.wait()
        terminal.close()


def get(port, path="/", method="GET", host=None):
    """Status, headers and body of one request."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    try:
        connection.putrequest(method, path, skip_host=host is not None)
        if host is not None:
            connection.putheader("Host", host)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, dict(answer.headers), answer.read()
    finally:
        connection.close()


@contextlib.contextmanager
def stream(port):
    """The feed as a browser reads it: the response, and an iterator of what it says."""
    with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as connection:
        connection.sendall(b"GET /feed HTTP/1.1\r\nHost: localhost\r\n\r\n")
        with connection.makefile("rb") as lines:
            yield lines.readline(), _said(lines)


def _said(lines):
    for line in lines:
        if line.startswith(b"data: "):
            yield json.loads(line[6:])


class Browser:
    """Chromium behind its debugging pipe (descriptors 3 and 4, JSON ended by NUL), one page."""

    def __init__(self, folder):
        to_read, self._out = os.pipe()
        self._in, to_write = os.pipe()
        self._process = subprocess.Popen(
            [sys.executable, "-c", _EXEC, str(to_read), str(to_write), CHROMIUM, *_FLAGS, f"--user-data-dir={folder}"],
            pass_fds=(to_read, to_write),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_read)
        os.close(to_write)
        self._rest, self._number, self._session = b"", 0, None
        self.complaints = []
        self.requests = []

    def __enter__(self):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        return self

    def __exit__(self, *_):
        os.close(self._out)
        self._process.terminate()
        self._process.wait()
        os.close(self._in)

    def call(self, method, **parameters):
        """One command; returns its result. What the page complains of meanwhile is kept."""
        self._number += 1
        order = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            order["sessionId"] = self._session
        os.write(self._out, json.dumps(order).encode() + b"\0")
        while True:
            said = self._hear()
            match said.get("method"):
                case "Log.entryAdded":
                    self.complaints.append(said["params"]["entry"]["text"])
                case "Runtime.exceptionThrown" | "Runtime.consoleAPICalled":
                    self.complaints.append(str(said["params"]))
                case "Network.requestWillBeSent":
                    self.requests.append(said["params"]["request"]["url"])
            if said.get("id") == self._number:
                assert "error" not in said, said
                return said["result"]

    def open(self, url):
        self.call("Page.navigate", url=url)

    def wait_for(self, expression):
        """Evaluate until it is true; returns what it is then."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            promise = f"new Promise(r => setTimeout(() => r({expression}), 50))"
            value = self.call("Runtime.evaluate", expression=promise, awaitPromise=True, returnByValue=True)
            if found := value["result"].get("value"):
                return found
        raise AssertionError(f"never true: {expression}; {self.complaints}")

    def _hear(self):
        while b"\0" not in self._rest:
            assert select.select([self._in], [], [], PATIENCE_S)[0], "the browser says nothing"
            piece = os.read(self._in, 65536)
            assert piece, "the browser has ended"
            self._rest += piece
        message, self._rest = self._rest.split(b"\0", 1)
        return json.loads(message)

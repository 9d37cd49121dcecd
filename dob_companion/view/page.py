"""The status page of `dob-companion run --status-page`: one page, and the feed as Server-Sent Events. Loopback only.

`python -m dob_companion.view.page FD`, fed on standard input (`view/feed.py`), serves on the listening socket FD.

Whoever asks too much of it is turned away: connections, streams and the time that one may take are bounded, and a
reader that is slow misses what has left the history in the meantime. Nothing flows back to the daemon.
"""

import base64
import hashlib
import re
import socket
import sys
import threading
from collections import deque
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import takewhile
from pathlib import Path
from typing import Any

from dob_companion.view.inlet import batches, stand_back

PAGE = Path(__file__).with_name("status.html")
MOMENTS = 600
"""Kept for who opens the page later: a minute at ten a second."""

EVENTS = 100
MOST_CONNECTIONS = 64
MOST_STREAMS = 16
PATIENCE_S = 5.0
"""A request that is not there after so long, or a reader that takes nothing for so long, is let go."""

_HOST = re.compile(r"(localhost|127\.0\.0\.1)(:\d{1,5})?")
"""Any port: it may be a tunnel's."""


class Board:
    """The feed for any number of readers: the introduction, the last moments and events, numbered."""

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._introduction = b"{}"
        self._moments: deque[tuple[int, bytes]] = deque(maxlen=MOMENTS)
        self._events: deque[tuple[int, bytes]] = deque(maxlen=EVENTS)
        self._number = 0
        self.closed = False

    def post(self, line: bytes) -> None:
        """Take a line of the feed."""
        with self._news:
            self._number += 1
            if line.startswith(b'{"daemon"'):
                self._introduction = line
            else:
                kept = self._moments if line.startswith(b'{"moment"') else self._events
                kept.append((self._number, line))
            self._news.notify_all()

    def after(self, number: int) -> tuple[list[bytes], int]:
        """What came after `number`, oldest first, and the number to ask with next. Waits for news, not for ever.

        After 0 comes everything that is kept, the introduction first.
        """
        with self._news:
            self._news.wait_for(lambda: self._number > number or self.closed, PATIENCE_S)
            new: list[tuple[int, bytes]] = []
            for kept in (self._moments, self._events):
                new += takewhile(lambda entry: entry[0] > number, reversed(kept))
            first = [] if number else [self._introduction]
            return first + [line for _, line in sorted(new)], self._number

    def close(self) -> None:
        """The feed has ended."""
        with self._news:
            self.closed = True
            self._news.notify_all()


class StatusServer(ThreadingHTTPServer):
    """Serves one board on a socket that already listens."""

    daemon_threads = True

    def __init__(self, listener: socket.socket, board: Board) -> None:
        super().__init__(listener.getsockname(), _Handler, bind_and_activate=False)
        self.socket.close()
        self.socket = listener
        self.board = board
        self.page = PAGE.read_bytes()
        self.policy = content_policy(self.page.decode())
        self.streams = threading.BoundedSemaphore(MOST_STREAMS)
        self._connections = threading.BoundedSemaphore(MOST_CONNECTIONS)

    def process_request(self, request: Any, client_address: Any) -> None:
        """One thread a connection, up to a limit; beyond it the door is shut at once."""
        if self._connections.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve, and make room for the next."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._connections.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: a reader who goes away in the middle is no news."""


class _Handler(BaseHTTPRequestHandler):
    """`/` is the page, `/feed` the stream, everything else is not there."""

    server: StatusServer
    timeout = PATIENCE_S
    server_version = "dob-companion"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer one request."""
        if not _HOST.fullmatch(self.headers.get("Host", "")):
            self.send_error(HTTPStatus.FORBIDDEN, "Asked under a foreign name")  # DNS rebinding
        elif self.path == "/":
            self._send_head("text/html; charset=utf-8", len(self.server.page))
            self.wfile.write(self.server.page)
        elif self.path == "/feed":
            self._stream()
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _stream(self) -> None:
        if not self.server.streams.acquire(blocking=False):
            self.send_error(HTTPStatus.SERVICE_UNAVAILABLE, "Too many readers")
            return
        try:
            self._send_head("text/event-stream")
            number, board = 0, self.server.board
            while not board.closed:
                lines, number = board.after(number)
                self.wfile.write(b"".join(b"data: " + line + b"\n\n" for line in lines) or b":\n\n")
        finally:
            self.server.streams.release()

    def _send_head(self, kind: str, length: int | None = None) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        if length is not None:
            self.send_header("Content-Length", str(length))
        self.end_headers()

    def end_headers(self) -> None:
        """Nothing of this is kept, framed, guessed at, or allowed to reach further than this server."""
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", self.server.policy)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        super().end_headers()

    def log_message(self, *_: Any) -> None:
        """Keep quiet."""


def content_policy(page: str) -> str:
    """A content security policy that lets the page's own script and style run, by their hashes, and nothing else."""
    hashes = {}
    for name in ("script", "style"):
        (body,) = re.findall(f"<{name}>(.*?)</{name}>", page, re.DOTALL)
        hashes[name] = base64.b64encode(hashlib.sha256(body.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{hashes['script']}'; style-src 'sha256-{hashes['style']}'; "
        "img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


def main(fd: int) -> None:
    """Serve until the feed ends."""
    stand_back()
    board = Board()
    server = StatusServer(socket.socket(fileno=fd), board)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    for lines in batches(PATIENCE_S):
        for line in lines:
            board.post(line)
    board.close()


if __name__ == "__main__":
    main(int(sys.argv[1]))

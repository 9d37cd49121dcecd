"""A TCP client's connection, sought without ever waiting for it."""

import contextlib
import errno
import fcntl
import os
import select
import socket
import struct
import termios
import time
from collections.abc import Callable, Generator
from typing import Any

from dob_companion.runtime.names import addresses
from dob_companion.runtime.stream import OutgoingLink
from dob_companion.runtime.urls import LinkUrl

REOPEN_S = 1.0
"""Wall time that an address has to answer in, and at least between two rounds over all of them."""

IN_FLIGHT_BYTES = 4096
"""What the kernel may hold for a peer: a quarter of a second of what a companion says. Where the peer or the network
stands still, no more than that is old when it goes on."""

WAITING_BYTES = 1 << 14
PIECE = 4096
"""Bytes read at once: a flood has to come in pieces that are soon dealt with."""


class TcpLink(OutgoingLink):
    """A client's connection, opened again when it is lost, over all addresses that its host had at the start.

    Raises LinkBusyError when there is no such host. One that is there and does not answer yet is no error.
    """

    def __init__(self, url: LinkUrl) -> None:
        super().__init__(url, WAITING_BYTES)
        self._addresses = addresses(url, socket.SOCK_STREAM)
        self._socket: socket.socket | None = None
        self._complained = False
        self._search = self._begin(0.0)
        self._found_at = 0.0
        self.fileno()

    def fileno(self) -> int:
        """The connection's descriptor, -1 while there is none."""
        if self._socket is None:
            self._socket = next(self._search)
            if self._socket is not None:
                self._complained, self._found_at = False, time.monotonic()
                self._say("connected")
        return self._socket.fileno() if self._socket else -1

    def read(self) -> bytes | None:
        """The next piece of the stream."""
        if self._socket is None:
            return None
        try:
            data = self._socket.recv(PIECE)
        except BlockingIOError:
            return None
        except OSError as problem:
            self._fail(problem)
            return None
        if not data:
            self._lose("the other end has closed the connection")
            return None
        return data

    def close(self) -> None:
        """Leave; what the kernel has taken it still sends."""
        self.flush()
        self._search.close()
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _up(self) -> bool:
        return self.fileno() >= 0

    def _room(self) -> int:
        return IN_FLIGHT_BYTES - _held(self._socket)

    def _send(self, data: bytes) -> int:
        if self._socket is None:
            return 0
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0

    def _fail(self, problem: OSError) -> None:
        self._lose(f"the connection is lost: {problem.strerror}")

    def _lose(self, why: str) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        self._outbox.clear()
        self._search = self._begin(self._found_at + REOPEN_S)
        self._warn(why)

    def _begin(self, at: float) -> Generator[socket.socket | None, None, None]:
        return connections(self._addresses, self._unanswered, at)

    def _unanswered(self, why: str) -> None:
        if not self._complained:
            self._complained = True
            self._warn(f"{why}; trying again every second")


def connections(
    hosts: list[tuple[socket.AddressFamily, Any]], complain: Callable[[str], None], begin_at: float
) -> Generator[socket.socket | None, None, None]:
    """Seek a connection from `begin_at` on, a step at each `next`: None while there is none, then the socket.

    `complain` hears why none of the addresses answered, once a round.
    """
    problem = 0
    while True:
        while time.monotonic() < begin_at:
            yield None
        begin_at = time.monotonic() + REOPEN_S
        for family, address in hosts:
            end = socket.socket(family, socket.SOCK_STREAM | socket.SOCK_NONBLOCK)
            with contextlib.ExitStack() as leaving:
                leaving.callback(end.close)
                problem = end.connect_ex(address)
                give_up_at = time.monotonic() + REOPEN_S
                while problem == errno.EINPROGRESS:
                    if select.select([], [end], [], 0.0)[1]:
                        problem = end.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
                    elif time.monotonic() >= give_up_at:
                        problem = errno.ETIMEDOUT
                    else:
                        yield None
                if not problem:
                    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    leaving.pop_all()
                    yield end
                    return
        complain(os.strerror(problem))


def _held(end: socket.socket | None) -> int:
    """Bytes that the kernel has and the peer has not acknowledged (tcp(7), SIOCOUTQ); 0 where it does not tell."""
    if end is None:
        return 0
    try:
        return int(struct.unpack("i", fcntl.ioctl(end, termios.TIOCOUTQ, b"\0\0\0\0"))[0])
    except OSError:
        return 0

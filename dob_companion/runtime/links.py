"""One link to the autopilot, as something to wait on, read from and write to. Nothing here blocks or raises when a
peer goes away: a lost connection is opened again, and what cannot be sent meanwhile is dropped."""

import contextlib
import errno
import socket
import time
from collections.abc import Callable
from typing import Any, Protocol

from dob_companion.companion import Event
from dob_companion.errors import LinkBusyError
from dob_companion.runtime.names import addresses
from dob_companion.runtime.serial_line import SerialLink
from dob_companion.runtime.stream import OutgoingLink
from dob_companion.runtime.tcp import TcpLink
from dob_companion.runtime.urls import LinkUrl

PEER_SILENCE_S = 1.0
"""A UDP peer that has been silent for so long may be replaced by another address."""

MOST_REFUSED = 256
"""Datagrams of strangers and errors passed over before the loop gets its turn: a flood must not hold it."""

KERNEL_BYTES = 1 << 14
"""What the kernel may keep for a slow interface. It doubles that and counts half a kilobyte and more a datagram: some
forty of them, an eighth of a second. By default it would be a second."""

WAITING_BYTES = 1 << 14
_LARGEST = 65536


class Link(Protocol):
    """What the runtime needs of a link."""

    def fileno(self) -> int:
        """A descriptor to wait on, or -1 while there is none."""

    def read(self) -> bytes | None:
        """What has come in, one piece a call; None when there is nothing."""

    def write(self, *messages: bytes) -> None:
        """Send messages; what the line does not take waits for `flush`, or is dropped, whole (see `Outbox`)."""

    def flush(self) -> bool:
        """Send what waits; whether something still does. Called in every turn of the loop."""

    def seal_with(self, seal: Callable[[bytes], bytes]) -> None:
        """Let each message pass through `seal` when its turn to leave has come."""

    def events(self) -> list[Event]:
        """What the operator should hear of the line since the last call."""

    def close(self) -> None:
        """Give the port back."""


def open_link(url: LinkUrl) -> Link:
    """Open a link. Raises LinkBusyError, one line, when the port or device cannot be had.

    A TCP server that is not there yet is no error: it is tried again.
    """
    if url.scheme == "serial":
        return SerialLink(url)
    if url.scheme == "tcp":
        return TcpLink(url)
    return UdpLink(url)


class UdpLink(OutgoingLink):
    """`udpin` listens and answers whoever speaks; `udpout` speaks to one address and hears only it.

    A listener answers one peer: the first heard, until that one has been silent, so that a stray datagram from
    elsewhere does not turn our corrections away from the aircraft.
    """

    def __init__(self, url: LinkUrl) -> None:
        super().__init__(url, WAITING_BYTES)
        family, address = addresses(url, socket.SOCK_DGRAM)[0]
        self._follows = url.scheme == "udpin"
        self._peer: Any = None if self._follows else address
        self._heard = 0.0
        with contextlib.ExitStack() as failing:
            try:
                self._socket = failing.enter_context(socket.socket(family, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK))
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BYTES)
                if self._follows:
                    self._socket.bind(address)
            except OSError as problem:
                raise LinkBusyError(f"link {url}: cannot be opened: {problem.strerror}") from None
            failing.pop_all()

    def fileno(self) -> int:
        """The socket's descriptor."""
        return self._socket.fileno()

    def read(self) -> bytes | None:
        """One datagram of the peer."""
        for _ in range(MOST_REFUSED):
            try:
                data, sender = self._socket.recvfrom(_LARGEST)
            except BlockingIOError:
                return None
            except OSError:  # a peer that has closed its port answers with an ICMP error: nothing was lost here
                continue
            if self._accepts(sender):
                return data
        return None

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _up(self) -> bool:
        return self._peer is not None

    def _room(self) -> int:
        return _LARGEST

    def _send(self, data: bytes) -> int:
        try:
            return self._socket.sendto(data, self._peer)
        except OSError as problem:  # no route, nobody there: a datagram lost; no room: it waits
            return 0 if problem.errno in (errno.EAGAIN, errno.ENOBUFS) else len(data)

    def _fail(self, problem: OSError) -> None:
        raise problem  # `_send` lets none pass

    def _accepts(self, sender: tuple[str, int]) -> bool:
        if not self._follows:
            return sender[:2] == self._peer[:2] if self._peer else False
        now = time.monotonic()
        if sender != self._peer:
            if self._peer is not None and now - self._heard < PEER_SILENCE_S:
                return False
            self._peer = sender
        self._heard = now
        return True

"""One link to the autopilot, as something to wait on, read from and write to. Nothing here blocks or raises when a
peer goes away: a lost connection is opened again, and what cannot be sent meanwhile is dropped."""

import contextlib
import socket
import time
from typing import Protocol

import serial

from dob_companion.errors import LinkBusyError
from dob_companion.runtime.urls import LinkUrl

REOPEN_S = 1.0
"""Wall time between two attempts to open a lost connection."""

PEER_SILENCE_S = 1.0
"""A UDP peer that has been silent for so long may be replaced by another address."""

_LARGEST = 65536


class Link(Protocol):
    """What the runtime needs of a link."""

    def fileno(self) -> int:
        """A descriptor to wait on, or -1 while there is none."""

    def read(self) -> bytes | None:
        """What has come in, one piece a call; None when there is nothing."""

    def write(self, data: bytes) -> None:
        """Send one message, or drop it."""

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


class UdpLink:
    """`udpin` listens and answers whoever speaks; `udpout` speaks to one address and hears only it.

    A listener answers one peer: the first heard, until that one has been silent, so that a stray datagram from
    elsewhere does not turn our corrections away from the aircraft.
    """

    def __init__(self, url: LinkUrl) -> None:
        try:
            family, _, _, _, address = socket.getaddrinfo(url.target, url.number, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
            self._socket.setblocking(False)
            if url.scheme == "udpin":
                self._socket.bind(address)
                self._peer = None
            else:
                self._peer = address
        except OSError as problem:
            raise LinkBusyError(f"link {url}: cannot be opened: {problem.strerror}") from None
        self._follows = url.scheme == "udpin"
        self._heard = 0.0

    def fileno(self) -> int:
        """The socket's descriptor."""
        return self._socket.fileno()

    def read(self) -> bytes | None:
        """One datagram of the peer."""
        while True:
            try:
                data, sender = self._socket.recvfrom(_LARGEST)
            except BlockingIOError:
                return None
            except OSError:  # a peer that has closed its port answers with an ICMP error: nothing was lost here
                continue
            if self._accepts(sender):
                return data

    def write(self, data: bytes) -> None:
        """Send one datagram to the peer, if one is known."""
        if self._peer is not None:
            try:  # not `suppress`: three calls more between an answer and its way out
                self._socket.sendto(data, self._peer)
            except OSError:
                return

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

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


class TcpLink:
    """A client's connection, opened again when it is lost."""

    def __init__(self, url: LinkUrl) -> None:
        self._url = url
        self._socket: socket.socket | None = None
        self._retry_at = 0.0
        self._open()

    def fileno(self) -> int:
        """The connection's descriptor, -1 while there is none."""
        if self._socket is None:
            self._open()
        return self._socket.fileno() if self._socket else -1

    def read(self) -> bytes | None:
        """The next piece of the stream."""
        if self._socket is None:
            return None
        try:
            data = self._socket.recv(_LARGEST)
        except BlockingIOError:
            return None
        except OSError:
            data = b""
        if not data:
            self.close()
            return None
        return data

    def write(self, data: bytes) -> None:
        """Send whole messages only: a peer that does not keep up loses the connection, not half a message."""
        if self._socket is None:
            return
        try:
            if self._socket.send(data) < len(data):
                self.close()
        except BlockingIOError:
            pass
        except OSError:
            self.close()

    def close(self) -> None:
        """Drop the connection; the next `fileno` opens it again."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _open(self) -> None:
        if time.monotonic() < self._retry_at:
            return
        self._retry_at = time.monotonic() + REOPEN_S
        try:
            self._socket = socket.create_connection((self._url.target, self._url.number), timeout=REOPEN_S)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.setblocking(False)
        except OSError:
            self._socket = None


class SerialLink:
    """A serial line, opened again when the device comes back."""

    def __init__(self, url: LinkUrl) -> None:
        self._url = url
        self._port: serial.Serial | None = None
        self._retry_at = 0.0
        try:
            self._port = self._opened()
        except (serial.SerialException, OSError, ValueError) as problem:
            raise LinkBusyError(f"link {url}: cannot be opened: {problem}") from None

    def fileno(self) -> int:
        """The device's descriptor, -1 while it is gone."""
        if self._port is None and time.monotonic() >= self._retry_at:
            self._retry_at = time.monotonic() + REOPEN_S
            with contextlib.suppress(serial.SerialException, OSError):
                self._port = self._opened()
        return int(self._port.fileno()) if self._port else -1

    def read(self) -> bytes | None:
        """The bytes that have come in."""
        if self._port is None:
            return None
        try:
            return self._port.read(_LARGEST) or None
        except (serial.SerialException, OSError):
            self.close()
            return None

    def write(self, data: bytes) -> None:
        """Queue a message for the line."""
        if self._port is None:
            return
        try:
            self._port.write(data)
        except serial.SerialTimeoutException:
            pass
        except (serial.SerialException, OSError):
            self.close()

    def close(self) -> None:
        """Give the device back; the next `fileno` opens it again."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def _opened(self) -> serial.Serial:
        return serial.Serial(self._url.target, self._url.number, timeout=0, write_timeout=0, exclusive=True)

"""A serial line that is never given more than it carries."""

import contextlib
import fcntl
import os
import struct
import termios
import threading
import time

import serial

from dob_companion.errors import LinkBusyError
from dob_companion.runtime.stream import OutgoingLink
from dob_companion.runtime.urls import LinkUrl

REOPEN_S = 1.0
"""Wall time between two attempts to open a device that is gone."""

AHEAD_S = 0.01
"""How much of the line's time the kernel may hold: the newest correction waits for that long, and no longer."""

WAITING_S = 0.5
"""How much of the line's time other messages may wait for."""

LAST_WORDS_S = 0.2
"""On leaving, how long the line has for what is still to be sent. The kernel itself would wait for half a minute."""

PIECE = 4096
"""Bytes read at once: a flood has to come in pieces that are soon dealt with."""

_BITS_A_BYTE = 10
_PSEUDO_TERMINALS = range(136, 144)
"""Device numbers (Linux, devices.txt). They do not say what they hold, and their far end may be anything."""

_TROUBLE = (serial.SerialException, OSError, ValueError, termios.error)
"""What opening and configuring a device may raise; `termios.error` is no OSError."""


class SerialLink(OutgoingLink):
    """A serial line, opened again when the device comes back. Raises LinkBusyError when it is not there at first."""

    def __init__(self, url: LinkUrl) -> None:
        self._rate = url.number / _BITS_A_BYTE
        super().__init__(url, round(WAITING_S * self._rate))
        self._port: serial.Serial | None = None
        self._fd = -1
        self._retry_at = 0.0
        self._opening: _Opening | None = None
        self._clocked = Clocked(self._rate)
        try:
            self._take(_opened(url))
        except _TROUBLE as problem:
            raise LinkBusyError(f"link {url}: cannot be opened: {problem}") from None

    def fileno(self) -> int:
        """The device's descriptor, -1 while it is gone."""
        if self._port is None:
            self._reopen(time.monotonic())
        return self._fd

    def _reopen(self, now: float) -> None:
        """Take the device that has come back, or begin to look for it."""
        if self._opening is None:
            if now >= self._retry_at:
                self._opening = _Opening(self._url)
            return
        if self._opening.is_alive():
            return
        port, self._opening, self._retry_at = self._opening.port, None, now + REOPEN_S
        if port is not None:
            with contextlib.suppress(*_TROUBLE):  # gone again
                self._take(port)
                self._say("the device is back")

    def read(self) -> bytes | None:
        """The bytes that have come in."""
        if self._port is None:
            return None
        try:
            return self._port.read(PIECE) or None
        except _TROUBLE as problem:
            self._lose(str(problem))
            return None

    def close(self) -> None:
        """Give the device back, after the last message if the line still moves."""
        give_up_at = time.monotonic() + LAST_WORDS_S
        while self._port is not None and (self._outbox or self._held()) and time.monotonic() < give_up_at:
            self.flush()
            time.sleep(AHEAD_S / 4)
        self._let_go()
        if self._opening is not None:
            self._opening.give_up()

    def _up(self) -> bool:
        return self._port is not None

    def _room(self) -> int:
        return max(1, round(AHEAD_S * self._rate)) - self._held()

    def _held(self) -> int:
        """Bytes that are still to leave this computer."""
        if not self._pseudo:
            with contextlib.suppress(OSError):
                return int(struct.unpack("i", fcntl.ioctl(self._fd, termios.TIOCOUTQ, b"\0\0\0\0"))[0])
        return self._clocked.held(time.monotonic())

    def _send(self, data: bytes) -> int:
        try:
            count = os.write(self._fd, data)
        except BlockingIOError:
            return 0
        self._clocked.given(count, time.monotonic())
        return count

    def _fail(self, problem: OSError) -> None:
        self._lose(str(problem.strerror))

    def _lose(self, why: str) -> None:
        self._let_go()
        self._warn(f"the device is gone: {why}; trying to open it every second")

    def _let_go(self) -> None:
        if self._port is not None:
            with contextlib.suppress(*_TROUBLE):  # else closing waits for a line that may stand still
                termios.tcflush(self._fd, termios.TCOFLUSH)
            with contextlib.suppress(*_TROUBLE):
                self._port.close()
            self._port, self._fd = None, -1
        self._outbox.clear()

    def _take(self, port: serial.Serial) -> None:
        fd = int(port.fileno())
        self._pseudo = os.major(os.fstat(fd).st_rdev) in _PSEUDO_TERMINALS
        self._port, self._fd, self._clocked = port, fd, Clocked(self._rate)


def _opened(url: LinkUrl) -> serial.Serial:
    return serial.Serial(url.target, url.number, timeout=0, write_timeout=0, exclusive=True)


class _Opening(threading.Thread):
    """Opens a device that may take its time: a driver waits for one that is just being plugged in, for seconds. `port`
    is what came of it, None where it could not be opened."""

    def __init__(self, url: LinkUrl) -> None:
        super().__init__(daemon=True)
        self.port: serial.Serial | None = None
        self._url = url
        self._wanted = True
        self.start()

    def run(self) -> None:
        """Open it, and close it again if nobody waits any more."""
        with contextlib.suppress(*_TROUBLE):
            self.port = _opened(self._url)
            if not self._wanted:
                self.port.close()

    def give_up(self) -> None:
        """Nobody waits for it any more."""
        self._wanted = False
        if not self.is_alive() and self.port is not None:
            self.port.close()


class Clocked:
    """What a line still holds by its rate alone (bytes/s), where the kernel does not tell."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._empty_at = 0.0

    def given(self, count: int, now: float) -> None:
        """The line has got `count` bytes more."""
        self._empty_at = max(self._empty_at, now) + count / self._rate

    def held(self, now: float) -> int:
        """Bytes that it has not sent yet."""
        return max(0, round((self._empty_at - now) * self._rate))

"""Telling systemd how we are (sd_notify(3)): ready, alive, leaving. Silent where nobody listens."""

import contextlib
import os
import socket
from collections.abc import Callable, Mapping

SLOWEST_S = 1.0
"""Wall time between two messages when no watchdog asks for more."""


class Notifier:
    """One datagram now and then to the socket in NOTIFY_SOCKET, never waited for.

    The watchdog is fed by `alive` alone, and the loop that answers the aircraft is the only caller: when that loop
    stands, the watchdog bites, whatever else in the process still runs.
    """

    def __init__(self, address: str | None, watchdog_s: float | None = None) -> None:
        self._address = "\0" + address[1:] if address and address.startswith("@") else address
        self._every = min(SLOWEST_S, watchdog_s / 4) if watchdog_s else SLOWEST_S
        self._next = float("-inf")
        self._ready = False
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) if address else None

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> "Notifier":
        """As systemd starts us. A watchdog that is meant for another process is not ours to feed."""
        watchdog = environment.get("WATCHDOG_USEC", "")
        ours = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        period = int(watchdog) * 1e-6 if ours and watchdog.isascii() and watchdog.isdigit() else None
        return cls(environment.get("NOTIFY_SOCKET"), period)

    def alive(self, now: float, describe: Callable[[], str]) -> None:
        """The loop turns: READY=1 the first time, then WATCHDOG=1 and STATUS= often enough."""
        if self._socket is None or now < self._next:
            return
        self._next = now + self._every
        ready = "" if self._ready else "READY=1\n"
        self._ready = True
        self._say(f"{ready}WATCHDOG=1\nSTATUS={' '.join(describe().split())}")

    def stopping(self) -> None:
        """We are on our way out."""
        self._say("STOPPING=1")

    def _say(self, text: str) -> None:
        if self._socket is not None and self._address:
            with contextlib.suppress(OSError):  # nobody there, or a full queue: the next one will do
                self._socket.sendto(text.encode(), socket.MSG_DONTWAIT, self._address)

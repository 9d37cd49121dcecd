"""One link's framing: a parser for what comes in, a packer and an outbox for what goes out."""

from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

MOST_PARSED = 4096
"""Bytes already parsed that a parser keeps at most."""

SYSTEM, COMPONENT = 1, mavlink.MAV_COMP_ID_AUTOPILOT1

Message = Any
"""A `pymavlink` message object."""


def source_of(message: Message) -> tuple[int, int]:
    """(system, component) that a message came from."""
    return message.get_srcSystem(), message.get_srcComponent()


class Port:
    """MAVLink 2 framing of one link, with the sequence number and the peers heard on it.

    Garbage on the line is counted in `bad`, never raised.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.heard: set[tuple[int, int]] = set()
        self.bad = 0
        self._mav = mavlink.MAVLink(None, SYSTEM, COMPONENT)
        self._mav.robust_parsing = True
        self._outbox: list[bytes] = []

    def parse(self, data: bytes) -> Iterator[Message]:
        """Messages completed by `data`; nonsense, unknown kinds and our own echo are left out."""
        try:
            messages = self._mav.parse_buffer(data) or ()
        except mavlink.MAVError:
            self.bad += 1
            return
        if self._mav.buf_index > MOST_PARSED:  # pymavlink forgets only when a piece ends with a message
            del self._mav.buf[: self._mav.buf_index]
            self._mav.buf_index = 0
        for message in messages:
            kind = message.get_type()
            if kind == "BAD_DATA":
                self.bad += 1
            elif not kind.startswith("UNKNOWN") and (source := source_of(message)) != (SYSTEM, COMPONENT):
                self.heard.add(source)
                yield message

    def send(self, message: Message) -> None:
        """Queue a message of the vehicle's own."""
        mav = self._mav
        self._outbox.append(message.pack(mav))
        mav.seq = (mav.seq + 1) % 256

    def forward(self, raw: bytes) -> None:
        """Queue somebody else's message unchanged."""
        self._outbox.append(raw)

    def take(self) -> list[bytes]:
        """Everything queued, one message each, and empty the queue."""
        out, self._outbox = self._outbox, []
        return out

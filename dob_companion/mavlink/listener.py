"""Everything that is said on a link, by name: for who only listens. What the companion flies by is read by `codec`."""

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.codec import bytewise
from dob_companion.mavlink.facts import Sender
from dob_companion.mavlink.makes import make_of
from dob_companion.mavlink.outline import is_signed, number_of
from dob_companion.mavlink.parser import forget_parsed, robust_parser
from dob_companion.mavlink.signing import Signature, SigningGate
from dob_companion.mavlink.speaker import StreamRequest

MOST_SAID = 1024
"""Own messages that are remembered. Another that speaks as we do has our sequence numbers by chance, not always."""

MOST_NUMBERS = 256
"""Of messages of other dialects, kept apart: no dialect adds as many, but garbage may look like any."""


@dataclass(frozen=True, slots=True)
class Heard:
    """One message. `stamp_us` is the vehicle's stamp in µs, None without one; `fine` tells whether it counts µs and not
    ms."""

    sender: Sender
    name: str
    stamp_us: int | None
    fine: bool
    signature: Signature


@dataclass(frozen=True, slots=True)
class Presence:
    """A heartbeat. `make` is "ArduPilot", "PX4", "generic" or "other" for an autopilot, "" for anything else."""

    sender: Sender
    make: str
    vehicle: str
    armed: bool


@dataclass(frozen=True, slots=True)
class ParameterHeard:
    """A PARAM_VALUE: read as a REAL32, and as the integer of its type that the same four bytes are (PX4 means that one;
    ArduPilot never does), None for a real type."""

    sender: Sender
    name: str
    value: float
    bytewise: int | None


@dataclass(frozen=True, slots=True)
class VersionHeard:
    """An AUTOPILOT_VERSION: the firmware's version in words."""

    sender: Sender
    text: str


class Listener:
    """Reads all messages of the common dialect; `bad` counts pieces of garbage, `unknown` well-formed messages of
    another dialect by their numbers, whose checksum nobody without that can check,
    `echoes` messages of our own that the link has sent back, which are nobody's.

    With a gate signatures are judged, and no message is kept back for its own.
    """

    def __init__(self, *, datagrams: bool = True, gate: SigningGate | None = None) -> None:
        self._gate = gate
        self.bad = self.echoes = 0
        self.unknown: Counter[int] = Counter()
        self._said: dict[bytes, None] = {}
        self._datagrams = datagrams
        self._parser = robust_parser()

    def said(self, message: bytes) -> None:
        """We send this message."""
        self._said[_content(message)] = None
        if len(self._said) > MOST_SAID:
            del self._said[next(iter(self._said))]

    def hear(self, data: bytes) -> Iterator[Heard | Presence | ParameterHeard | VersionHeard]:
        """What `data` says: one datagram, or any piece of a byte stream."""
        for message in self._messages(data):
            if _content(bytes(message.get_msgbuf())) in self._said:
                self.echoes += 1
                continue
            number = message.get_msgId()
            if number == mav.MAVLINK_MSG_ID_HEARTBEAT:
                yield _presence(message)
            elif number == mav.MAVLINK_MSG_ID_PARAM_VALUE:
                yield ParameterHeard(_sender(message), message.param_id, message.param_value, bytewise(message))
            elif number == mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
                yield VersionHeard(_sender(message), _version(message.flight_sw_version))
            name = message.get_type()
            if name.startswith("UNKNOWN"):
                self._unknown(number_of(bytes(message.get_msgbuf())))
            else:
                yield self._heard(message, name)

    def _unknown(self, number: int) -> None:
        if number in self.unknown or len(self.unknown) < MOST_NUMBERS:
            self.unknown[number] += 1

    def _heard(self, message: Any, name: str) -> Heard:
        fine = getattr(message, "time_usec", None)
        coarse = getattr(message, "time_boot_ms", None)
        stamp = fine if fine is not None else coarse * 1000 if coarse is not None else None
        return Heard(_sender(message), name, stamp, fine is not None, self._signature(bytes(message.get_msgbuf())))

    def _signature(self, frame: bytes) -> Signature:
        if self._gate is not None:
            return self._gate.judge(frame)
        return Signature.UNCHECKED if is_signed(frame) else Signature.UNSIGNED

    def _messages(self, data: bytes) -> Iterator[Any]:
        try:
            found = self._parser.parse_buffer(data) or []
        except (mav.MAVError, struct.error, ValueError, IndexError):
            found = []
            self._parser, self.bad = robust_parser(), self.bad + 1
        if self._datagrams and self._parser.buf_len() > 0:
            self._parser, self.bad = robust_parser(), self.bad + 1
        forget_parsed(self._parser)
        for message in found:
            if message.get_type() == "BAD_DATA":
                self.bad += 1
            else:
                yield message


def stream_request(name: str, interval_us: int) -> StreamRequest:
    """A message of the common dialect wanted at an interval; 0 stands for the vehicle's own default."""
    return StreamRequest(name, getattr(mav, f"MAVLINK_MSG_ID_{name}"), interval_us)


def _content(frame: bytes) -> bytes:
    """What a MAVLink 2 frame says, with its sequence number and its sender, but without what signing changes."""
    return frame[4 : 10 + frame[1]]


def _sender(message: Any) -> Sender:
    return Sender(message.get_srcSystem(), message.get_srcComponent())


def _version(packed: int) -> str:
    """Major, minor, patch, and the type of the release: a byte each, FIRMWARE_VERSION_TYPE."""
    major, minor, patch, kind = packed.to_bytes(4, "big")
    named = mav.enums["FIRMWARE_VERSION_TYPE"].get(kind)
    word = named.name.removeprefix("FIRMWARE_VERSION_TYPE_").lower() if named else ""
    return f"{major}.{minor}.{patch}" + (f" {word}" if word not in ("", "official") else "")


def _presence(message: Any) -> Presence:
    kind = mav.enums["MAV_TYPE"].get(message.type)
    return Presence(
        _sender(message),
        make_of(message),
        kind.name.removeprefix("MAV_TYPE_").lower().replace("_", " ") if kind else f"type {message.type}",
        bool(message.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED),
    )

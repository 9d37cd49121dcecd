"""MAVLink 2 message signing (https://mavlink.io/en/guide/message_signing.html), as a gate before the codec. Pure.

A frame passes if it bears the signature of our key and a timestamp newer than the last of its stream (link id, system,
component). The gate drops the others and counts them; what passes is left as it came, so that neither the codec nor a
recorder needs the key.

pymavlink's own check takes note of a timestamp before it looks at the signature, so that one forged frame from the far
future locks its victim out. Here the signature comes first.
"""

import hmac
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from hashlib import sha256

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.frame import EXTRA, crc
from dob_companion.mavlink.outline import (
    CHECKSUM,
    KNOWN_FROM,
    SIGNED,
    V1,
    V2,
    checksum_of,
    covered,
    is_signed,
    number_of,
    size_at,
)

KEY_BYTES = 32
TICK_S = 1e-5
"""Unit of a timestamp, counted from 2015-01-01 GMT."""

EPOCH_UNIX_S = 1_420_070_400
OLDEST_NEW_STREAM = 6_000_000
"""A stream not heard before may lag our own timestamp by one minute, in ticks (the standard's rule)."""

MOST_STREAMS = 64
"""Streams remembered at once. A link has a handful: of whoever has the key and speaks under ever new ids, no more are
let in until old ones have been silent for a minute."""

_LAST_TIMESTAMP = (1 << 48) - 1
_AFTER = b"", bytes((V1,)), bytes((V2,))
"""What may follow a frame: nothing, or another."""


class Signature(StrEnum):
    """What a frame's signature is worth; all but UNCHECKED are a counter's name."""

    ADMITTED = "admitted"
    UNSIGNED = "unsigned"
    WRONG = "wrong"
    REPLAYED = "replayed"
    UNCHECKED = "unchecked"


@dataclass(slots=True)
class SigningCounters:
    """What the gate did. `unsigned` counts MAVLink 1 as well; `replayed` whatever bears our key and is too old,
    or comes under one id too many."""

    admitted: int = 0
    unsigned: int = 0
    wrong: int = 0
    replayed: int = 0

    @property
    def refused(self) -> int:
        """Frames that did not pass."""
        return self.unsigned + self.wrong + self.replayed


def ticks(unix_s: float) -> int:
    """The timestamp of a moment, from seconds since 1970; 0 for a clock that stands before 2015."""
    return max(0, int((unix_s - EPOCH_UNIX_S) / TICK_S))


class SigningGate:
    """One key on one link. `timestamp` is the newest used or heard; it must be carried over a restart.

    `datagrams` tells whether data come as whole datagrams or as pieces of a byte stream.
    """

    def __init__(self, key: bytes, timestamp: int, *, link_id: int = 0, datagrams: bool = True) -> None:
        if len(key) != KEY_BYTES:
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, not {len(key)}")
        self.counters = SigningCounters()
        self.timestamp = timestamp
        self._key = key
        self._link_id = link_id
        self._datagrams = datagrams
        self._streams: dict[tuple[int, int, int], int] = {}
        self._rest = b""

    def sign(self, message: bytes, now: int) -> bytes:
        """A packed MAVLink 2 message of ours with its signature; `now` is the clock in ticks, which may jump."""
        self.timestamp = min(max(now, self.timestamp + 1), _LAST_TIMESTAMP)
        frame = bytearray(message[:-CHECKSUM])
        frame[2] |= SIGNED
        frame += crc(bytes(frame[1:]) + EXTRA[mav.mavlink_map[number_of(message)].crc_extra]).to_bytes(2, "little")
        frame += bytes([self._link_id]) + self.timestamp.to_bytes(6, "little")
        return bytes(frame) + self._signature(frame)

    def admit(self, data: bytes) -> bytes:
        """The frames in `data` that pass, as they came."""
        return b"".join(frame for frame in self._frames(self._rest + data) if self.judge(frame) is Signature.ADMITTED)

    def _frames(self, data: bytes) -> Iterator[bytes]:
        """Whole frames with a right checksum, and in `_rest` what may become one. Garbage and messages that we do not
        know are left out: nobody behind us reads them."""
        at = 0
        while at < len(data):
            size = size_at(data, at)
            if at + size > len(data) and not self._datagrams:
                break  # the rest of it is still to come
            frame = data[at : at + size]
            number = number_of(frame) if len(frame) == size > KNOWN_FROM else None
            if number is None:
                at += 1
            elif number not in mav.mavlink_map:
                at += size if data[at + size : at + size + 1] in _AFTER else 1
            elif crc(covered(frame) + EXTRA[mav.mavlink_map[number].crc_extra]) == checksum_of(frame):
                yield frame
                at += size
            else:
                at += 1  # a start mark within something else
        self._rest = b"" if self._datagrams else data[at:]

    def judge(self, frame: bytes) -> Signature:
        """What one whole frame's signature is worth. Counts it, and a frame admitted now is replayed the next time."""
        verdict = self._judged(frame)
        setattr(self.counters, verdict, getattr(self.counters, verdict) + 1)
        return verdict

    def _judged(self, frame: bytes) -> Signature:
        if not is_signed(frame):
            return Signature.UNSIGNED
        if not hmac.compare_digest(self._signature(frame[:-6]), frame[-6:]):
            return Signature.WRONG
        stamp, stream = int.from_bytes(frame[-12:-6], "little"), (frame[-13], frame[5], frame[6])
        if stamp <= self._streams.get(stream, self.timestamp - OLDEST_NEW_STREAM - 1):
            return Signature.REPLAYED
        if stream not in self._streams and not self._room():
            return Signature.REPLAYED
        self._streams[stream] = stamp
        self.timestamp = max(self.timestamp, stamp)
        return Signature.ADMITTED

    def _room(self) -> bool:
        """Whether another stream may be remembered. One that is older than a new stream may be need not be."""
        if len(self._streams) >= MOST_STREAMS:
            oldest = self.timestamp - OLDEST_NEW_STREAM
            self._streams = {stream: stamp for stream, stamp in self._streams.items() if stamp >= oldest}
        return len(self._streams) < MOST_STREAMS

    def _signature(self, signed: bytes | bytearray) -> bytes:
        return sha256(self._key + signed).digest()[:6]

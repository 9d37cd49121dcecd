"""A relay of datagrams between an autopilot and its companion, in a process of its own, that spoils what it is told to.

The autopilot speaks to VEHICLE_PORT, the companion listens at COMPANION_PORT; one datagram, one message. Every message
is kept with the time at which it came, that at which it left, and what became of it: `passed` reads it back.
"""

import contextlib
import heapq
import multiprocessing
import os
import select
import socket
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

import numpy as np

VEHICLE_PORT, COMPANION_PORT = 14540, 14541
HEAD = struct.Struct("<ddBBH")
PRIORITY = 31
"""Real-time priority where it may be had: a wire does not wait for other programs, nor for a daemon at 20."""


class Way(IntEnum):
    """Direction of a message."""

    DOWN = 0  # autopilot to companion
    UP = 1  # companion to autopilot


class Fate(IntEnum):
    """What became of a message."""

    WHOLE = 0
    LOST = 1
    CORRUPT = 2
    TWICE = 3


@dataclass(frozen=True)
class Faults:
    """What happens to the messages of one direction: shares of them, and times in s."""

    lost: float = 0.0
    corrupt: float = 0.0
    twice: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0


NONE, CUT = Faults(), Faults(lost=1.0)


class Passed(NamedTuple):
    """A message that came to the relay: monotonic times in s; `left` of a lost one is that of its loss."""

    came: float
    left: float
    way: Way
    fate: Fate
    frame: bytes


class Relay:
    """The relay's handle. `spoil` holds until it is called again."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe

    def spoil(self, down: Faults = NONE, up: Faults = NONE) -> float:
        """From now on these faults. Returns when it began, monotonic s."""
        self._pipe.send((down, up))
        return float(self._pipe.recv())


@contextlib.contextmanager
def relay(log: Path, seed: int = 1) -> Iterator[Relay]:
    """A running relay that keeps what it passes in `log`."""
    ours, theirs = multiprocessing.Pipe()
    context = multiprocessing.get_context("fork")
    process = context.Process(target=_serve, args=(theirs, log, seed), daemon=True)
    process.start()
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(process.pid, os.SCHED_RR, os.sched_param(PRIORITY))
    try:
        yield Relay(ours)
    finally:
        ours.send(None)
        process.join(20)


def passed(log: Path) -> Iterator[Passed]:
    """What a relay has kept, in the order in which it came."""
    data, at = log.read_bytes(), 0
    while at + HEAD.size <= len(data):
        came, left, way, fate, length = HEAD.unpack_from(data, at)
        at += HEAD.size
        yield Passed(came, left, Way(way), Fate(fate), data[at : at + length])
        at += length


def messages_in(datagram: bytes) -> Iterator[bytes]:
    """The MAVLink messages that lie in a datagram, one after another."""
    at = 0
    while at + 3 <= len(datagram):
        size = 8 + datagram[at + 1]
        if datagram[at] == 0xFD:
            size += 4 + 13 * (datagram[at + 2] & 1)
        yield datagram[at : at + size]
        at += size


def corrupted(frame: bytes, rng: np.random.Generator) -> bytes:
    """A burst of up to 16 wrong bits behind the length, which a checksum always finds."""
    first = int(rng.integers(16, 8 * len(frame) - 16))
    burst = (int(rng.integers(0, 1 << 14)) << 1 | 0x8001) << (first % 8)
    spoilt = bytearray(frame)
    for i, byte in enumerate(burst.to_bytes(3, "little")):
        if first // 8 + i < len(spoilt):
            spoilt[first // 8 + i] ^= byte
    return bytes(spoilt)


@dataclass
class _Wire:
    """Both sockets, and what is under way."""

    vehicle: socket.socket
    companion: socket.socket
    rng: np.random.Generator
    autopilot: tuple[str, int] | None = None
    faults: dict[Way, Faults] = field(default_factory=lambda: {Way.DOWN: NONE, Way.UP: NONE})
    under_way: list[tuple[float, int, Way, bytes]] = field(default_factory=list)
    count: int = 0

    def take(self, way: Way, frame: bytes, now: float) -> Passed:
        faults, fate = self.faults[way], Fate.WHOLE
        due = now + faults.delay + faults.jitter * self.rng.random()
        chance = self.rng.random()
        if chance < faults.lost:
            return Passed(now, now, way, Fate.LOST, frame)
        if chance < faults.lost + faults.corrupt:
            fate, sent = Fate.CORRUPT, corrupted(frame, self.rng)
        else:
            sent = frame
        self.put(due, way, sent)
        if fate is Fate.WHOLE and self.rng.random() < faults.twice:
            fate = Fate.TWICE
            self.put(due + 0.004 * self.rng.random(), way, sent)
        return Passed(now, due, way, fate, frame)

    def put(self, due: float, way: Way, frame: bytes) -> None:
        self.count += 1
        heapq.heappush(self.under_way, (due, self.count, way, frame))

    def deliver(self, now: float) -> None:
        while self.under_way and self.under_way[0][0] <= now:
            _, _, way, frame = heapq.heappop(self.under_way)
            with contextlib.suppress(OSError):  # nobody there: as on a wire
                if way is Way.DOWN:
                    self.companion.sendto(frame, ("127.0.0.1", COMPANION_PORT))
                elif self.autopilot:
                    self.vehicle.sendto(frame, self.autopilot)

    def read(self, way: Way, now: float) -> Iterator[Passed]:
        end = self.vehicle if way is Way.DOWN else self.companion
        while True:
            try:
                datagram, sender = end.recvfrom(4096)
            except OSError:  # nothing more, or nobody at the other end
                return
            if way is Way.DOWN:
                self.autopilot = sender
            for frame in messages_in(datagram):
                yield self.take(way, frame, now)


def _socket(port: int) -> socket.socket:
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.bind(("127.0.0.1", port))
    end.setblocking(False)
    return end


def _serve(pipe: Connection, log: Path, seed: int) -> None:
    with _socket(VEHICLE_PORT) as vehicle, _socket(0) as companion, log.open("wb") as kept:
        wire = _Wire(vehicle, companion, np.random.default_rng(seed))
        ways = {vehicle: Way.DOWN, companion: Way.UP}
        while True:
            wait = max(0.0, wire.under_way[0][0] - time.monotonic()) if wire.under_way else 1.0
            ready, _, _ = select.select([vehicle, companion, pipe], [], [], wait)
            now = time.monotonic()
            for end in ready:
                if end is pipe:
                    asked = pipe.recv()
                    if asked is None:
                        return
                    wire.faults = dict(zip(Way, asked, strict=True))
                    pipe.send(now)
                else:
                    for p in wire.read(ways[end], now):
                        kept.write(HEAD.pack(p.came, p.left, p.way, p.fate, len(p.frame)) + p.frame)
            wire.deliver(time.monotonic())

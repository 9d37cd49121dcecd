"""A flight in simulated time through a link that goes wrong in every way we know, one kind after the other.

1 % of all messages are lost throughout, either way. Every few seconds a fault of the next kind begins; it ends, and the
time until the correction is fully in again is its recovery time. The vehicle takes corrections up, holds and
fades them as docs/interfaces.md says, and reports what acts (`tests/companion/takeup.py`, which judges it too).
"""

import heapq
import struct
from collections import defaultdict

import numpy as np
from pymavlink.dialects.v20 import common as mav

from dob_companion.supervisor import State
from tests.companion.aircraft import DT, T0, aircraft
from tests.companion.takeup import TakeUp
from tests.endurance.oracle import LIMIT, Oracle

LOSS = 0.01
KINDS = {
    "1 % loss alone": 2.0,
    "jitter burst, up to 5 ms": 1.0,
    "reordered messages": 0.5,
    "corrupt bytes": 1.0,
    "vehicle clock jumps back": 0.0,
    "vehicle clock jumps ahead": 0.0,
    "link cut": 1.0,
    "link cut, short": 0.02,
    "vehicle to companion cut": 0.15,
    "companion to vehicle cut": 1.0,
    "companion to vehicle cut, short": 0.07,
    "companion stands still": 0.4,
    "parameter flood": 0.5,
    "hostile second system": 1.0,
    "gyro not finite": 0.004,
    "moment not finite": 0.004,
    "switched off and on": 0.004,
}
"""Every kind of fault, and how long it lasts in s; a cut up to three times as long."""

PATIENCE_S = 15.0
FOREIGN = [b"DOB_NONE", b"SYSID_THISMAV", b"DOB_LIMIT", b"DOB_GAIN", b"DOB_RAMP_S", b"DOB_STATE", b"DOB_AXES"]
REFUSED = [float("nan"), float("inf"), -1.0, 99.0, 1e30]


class Campaign:
    """Flies; `times` and `recoveries` by kind, `oracle` with its findings."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.plane = aircraft()
        self.companion = self.plane.companion
        self.oracle = Oracle()
        self.takeup = TakeUp(largest=LIMIT)
        self.recoveries = defaultdict(list)
        self.unrecovered = []
        self.corrupted = self.lost = self.sent = self.samples = 0
        self._hostile = mav.MAVLink(None, srcSystem=9, srcComponent=1)
        self._on_the_way, self._order = [], 0
        self._now, self._stamp, self._fault = 0.0, T0, ""
        self._sample_began = 0.0
        self._phase = self.rng.uniform(0, 6, 3)

    def fly(self, seconds, kinds=tuple(KINDS)):
        """One campaign of so many simulated seconds, the faults of these kinds by turns."""
        self._until(State.TRACKING, wish=False)
        self._operator(1.0)
        self._until(State.ACTIVE)
        number = 0
        while self._now < seconds:
            self._one(kinds[number % len(kinds)])
            number += 1
        self._operator(0.0)
        self._seconds(2.0)
        return self

    def a_second_autopilot(self):
        """Comes last, since it forbids injecting for good. Returns whether the companion faded out."""
        self._operator(1.0)
        self._until(State.ACTIVE)
        self._deliver(
            bytes(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3).pack(self._hostile))
        )
        self._seconds(3.0)
        return not self.companion.loop.injecting

    def _one(self, kind):
        lasts = KINDS[kind] * (self.rng.uniform(0.5, 3.0) if "cut" in kind else 1.0)
        match kind:
            case "vehicle clock jumps back":
                self._stamp -= int(self.rng.uniform(1.5e6, 5e6))
                self.takeup.restart()
            case "vehicle clock jumps ahead":
                self._stamp += 4000 * int(self.rng.integers(5, 500))
        self._fault = kind
        self._seconds(lasts)
        self._fault = ""
        if kind == "companion stands still":
            self._wake()
        if kind in ("gyro not finite", "moment not finite", "switched off and on"):
            self._operator(0.0)
            self._seconds(0.1)
            self._operator(1.0)
        began = self._now
        if self._until(State.ACTIVE):
            self.recoveries[kind].append(self._now - began)
        else:
            self.unrecovered.append((kind, self.companion.status()))
        self._seconds(self.rng.uniform(0.5, 1.5))

    def _until(self, state, wish=True):
        end = self._now + PATIENCE_S
        while self._now < end:
            self._sample()
            if (self.companion.loop.state is state) if wish else (self._now > 3.0):
                return True
        return False

    def _seconds(self, seconds):
        end = self._now + seconds
        while self._now < end:
            self._sample()

    def _operator(self, value):
        message = mav.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", value, 9)
        self._deliver(bytes(message.pack(self.plane.ground)))

    # One sample of the vehicle ---------------------------------------------------------------------------------

    def _sample(self):
        rates = _single(0.15 * np.sin(0.7 * self._now + self._phase) + self.rng.normal(0.0, 0.02, 3))
        moment = _single(self.rng.normal(0.0, 0.02, 3))
        if self._fault == "gyro not finite":
            rates = (rates[0], float("nan"), rates[2])
        if self._fault == "moment not finite":
            moment = (float("inf"), moment[1], moment[2])
        if self.samples % 250 == 0:
            beat = mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3)
            self._deliver(bytes(beat.pack(self.plane.out)))
        stamp, self._sample_began = self._stamp, self._now
        acts, age = self.takeup.at(stamp)
        self.plane.contained = acts
        self._send(self.plane.imu(stamp, rates), lambda: self.oracle.gyro(stamp, rates), 0.0)
        self._send(self.plane.target(stamp, moment, age), lambda: self._moment(stamp, moment), 2e-4)
        self._strangers()
        self.samples += 1
        self._stamp += 4000
        self._arrive(self._now + DT)

    def _moment(self, stamp, moment):
        if np.all(np.isfinite(moment)):
            self.oracle.moment(stamp, moment)
        else:
            self.oracle.spoil()

    def _send(self, message, told, after):
        data = bytes(message.pack(self.plane.out))
        self.sent += 1
        if self._cut("vehicle to companion") or self.rng.random() < LOSS:
            self.lost += 1
            return
        at = self._now + after
        if self._fault.startswith("jitter"):
            at += self.rng.uniform(0.0, 0.005)
        if self._fault.startswith("reordered") and self.rng.random() < 0.2:
            at += self.rng.choice([0.0045, 0.0085])
        if self._fault.startswith("corrupt") and self.rng.random() < 0.05:
            data, told = self._corrupt(data), lambda: None
        self._order += 1
        heapq.heappush(self._on_the_way, (at, self._order, data, told))

    def _cut(self, way):
        """Whether the link is cut this way."""
        return self._fault.startswith(("link cut", f"{way} cut"))

    def _corrupt(self, data):
        """A burst of up to 16 wrong bits within what the checksum covers, which CRC-16 always finds; longer damage
        passes it once in 65536 times, which no receiver of MAVLink can know."""
        self.corrupted += 1
        number = int.from_bytes(data[1:], "little")
        burst = int(self.rng.integers(1, 1 << 16)) | 1
        number ^= burst << int(self.rng.integers(0, 8 * (len(data) - 1) - 16))
        return data[:1] + number.to_bytes(len(data) - 1, "little")

    def _strangers(self):
        if self._fault.startswith("hostile"):
            wrong = tuple(self.rng.uniform(-3, 3, 3))
            self._deliver(bytes(self.plane.imu(self._stamp, wrong).pack(self._hostile)))
            self._deliver(bytes(self.plane.target(self._stamp, wrong).pack(self._hostile)))
            write = mav.MAVLink_param_set_message(9, 191, b"DOB_LIMIT", 1.0, 9)
            self._deliver(bytes(write.pack(self._hostile)))
            self._deliver(self.rng.bytes(40))
        if self._fault.startswith("parameter"):
            for _ in range(4):
                name, value = FOREIGN[self.rng.integers(len(FOREIGN))], REFUSED[self.rng.integers(len(REFUSED))]
                write = mav.MAVLink_param_set_message(1, 191, name, value, 9)
                self._deliver(bytes(write.pack(self.plane.ground)))
            self._deliver(bytes(mav.MAVLink_param_request_list_message(1, 191).pack(self.plane.ground)))

    # Time ------------------------------------------------------------------------------------------------------

    def _arrive(self, until):
        """What arrives, and what falls due, until then."""
        while True:
            if self._fault == "companion stands still":
                break
            next_in = self._on_the_way[0][0] if self._on_the_way else float("inf")
            due = self.companion.next_deadline()
            if min(next_in, due) > until:
                break
            if next_in <= due:
                self._now, _, data, told = heapq.heappop(self._on_the_way)
                told()
                self._deliver(data)
            else:
                self._now = max(self._now, due)
                self._deliver(b"")
        self._now = until

    def _wake(self):
        """The companion goes on, and finds all that came meanwhile before it can answer any of it."""
        while self._on_the_way and self._on_the_way[0][0] <= self._now:
            _, _, data, told = heapq.heappop(self._on_the_way)
            told()
            self.companion.receive(data, self._now)
        self._deliver(b"")

    def _deliver(self, data):
        if data:
            self.companion.receive(data, self._now)
        if self._fault == "companion stands still":
            return
        self.companion.advance(self._now)
        self.companion.events()
        for said in self.companion.bytes_to_send():
            if said[7:10] == b"\xfa\0\0":  # DEBUG_VECT
                stamp, *c = struct.unpack_from("<Qfff", said, 10)
                self.oracle.correction(stamp, tuple(c))
                if not self._cut("companion to vehicle") and self.rng.random() >= LOSS:
                    vehicle_us = self._stamp - 4000 + round(1e6 * (self._now - self._sample_began))
                    self.takeup.takes(stamp, tuple(c), vehicle_us)


def _single(values):
    """As they arrive: in single precision."""
    return tuple(np.float32(values).astype(float).tolist())

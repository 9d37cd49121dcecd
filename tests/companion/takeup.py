"""The vehicle's side of a correction, written again from docs/interfaces.md (Taking up a correction), and a judge of
what acts there: once the vehicle has begun to fade by itself, nothing but zero may come before a ramp-in from zero.
"""

import math
from dataclasses import dataclass, field

from tests.companion.aircraft import DT, Aircraft, corrections

DT_US = round(DT * 1e6)
HOLD_US = FADE_US = 100_000
ZERO = (0.0, 0.0, 0.0)
ROUNDING = 1e-6


class TakeUp:
    """The newest stamp wins; the last correction is held for 100 ms without news, then fades within 100 ms.

    `wrong` collects what the vehicle took after a time-out of its own and must not have been sent: anything whose size
    is beyond `largest` times the share of a ramp-in that can have passed since the newest zero that was taken.
    """

    def __init__(self, largest=1.0, ramp_s=0.5):
        self.largest, self.ramp_s = largest, ramp_s
        self.value, self.stamp, self.news = ZERO, None, None
        self.timed_out = self.zero_at = None
        self.timeouts = 0
        self.wrong = []

    def takes(self, stamp, value, now_us):
        """A correction arrives."""
        self.at(now_us)
        if not all(map(math.isfinite, value)) or max(map(abs, value)) > 1.0 or stamp > now_us:
            return
        if self.stamp is not None and stamp <= self.stamp:
            return
        if self.timed_out is not None:
            self._judge(stamp, value, now_us)
        self.value, self.stamp, self.news = value, stamp, now_us

    def at(self, now_us):
        """What acts now, and its age in samples, -1 without one."""
        if self.stamp is None:
            return ZERO, -1.0
        silence = now_us - self.news
        if silence > HOLD_US and self.timed_out is None and any(self.value):
            self.timed_out, self.zero_at = now_us, None
            self.timeouts += 1
        if silence >= HOLD_US + FADE_US:
            return ZERO, -1.0
        share = min(1.0, 1.0 - (silence - HOLD_US) / FADE_US)
        return tuple(share * v for v in self.value), (now_us - self.stamp) / DT_US

    def restart(self):
        """The vehicle starts anew."""
        self.value, self.stamp, self.news = ZERO, None, None
        self.timed_out, self.zero_at = 0, None  # as after a time-out: only a ramp-in may follow

    def _judge(self, stamp, value, now_us):
        if value == ZERO:
            self.zero_at = stamp
            return
        since = 0.0 if self.zero_at is None else 1e-6 * (stamp - self.zero_at)
        share = since / self.ramp_s if self.ramp_s else float(since > 0.0)
        if max(map(abs, value)) > self.largest * min(1.0, share) + ROUNDING:
            self.wrong.append((stamp, value, now_us, self.zero_at))
        if share >= 1.0:
            self.timed_out = None


@dataclass
class TakingAircraft(Aircraft):
    """Takes the companion's corrections up and reports them; what acts on it besides is `wind`, a moment that the gyro
    shows as it is, so that the observer of `small_design` finds it. `up` and `down` are the directions of its link: to
    the vehicle, and from it."""

    wind: tuple = ZERO
    up: bool = True
    down: bool = True
    takeup: TakeUp = field(default_factory=TakeUp)
    applied: list = field(default_factory=list)

    def pair(self):
        """One sample: what acts, what is told of it, what comes back. Returns the corrections that were sent."""
        self._fly()
        if self.beats and self.sample % 250 == 0:
            self.heartbeat()
        heard = self.deliver(self.imu(), self.target()) if self.down else self.listen()
        sent = corrections(heard)
        self.arrive(sent)
        self.sample += 1
        self.now += DT
        return sent

    def _fly(self):
        self.contained, self.age = self.takeup.at(self.stamp)
        self.moment = self.contained
        self.applied.append(self.contained)
        self.rates = tuple(a + b for a, b in zip(self.wind, self.contained, strict=True))

    def silence(self, seconds):
        """Time passes on the ground, none on the vehicle: one that waits, in lockstep."""
        until = self.now + seconds
        while self.now < until:
            self.now = min(max(self.companion.next_deadline(), self.now + 1e-4), until)
            self.arrive(corrections(self.listen()))

    def arrive(self, sent):
        """Corrections arrive within the sample, if the link carries them."""
        for message in sent if self.up else ():
            self.takeup.takes(message.time_usec, (message.x, message.y, message.z), self.stamp + DT_US // 2)

    def stalled(self, count):
        """The companion stands still for so many samples, and finds all of them at once; returns what it sends."""
        for _ in range(count):
            self._fly()
            for message in (self.imu(), self.target()):
                self.companion.receive(bytes(message.pack(self.out)), self.now + count * DT)
            self.sample += 1
        self.now += count * DT
        sent = corrections(self.listen())
        self.arrive(sent)
        return sent

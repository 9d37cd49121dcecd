"""Listening to a vehicle without flying it: what `doctor` does on a link, as a pure object with the companion's verbs.

It sends heartbeats, requests for streams, parameters and version, and TIMESYNC; it writes no parameter and corrects
nothing. When it is done it asks the
vehicle to send at its own rates again.
"""

from collections import Counter, defaultdict, deque
from collections.abc import Callable
from enum import Enum

import numpy as np

from dob_companion.artifact import DobDesign
from dob_companion.companion.clocks import ClockCheck
from dob_companion.companion.streams import StreamRequests
from dob_companion.doctor.pairs import Pairs
from dob_companion.doctor.reading import ParameterReading
from dob_companion.doctor.rotation import RotationSearch
from dob_companion.doctor.streamlog import MOST_KEPT, StreamLog
from dob_companion.mavlink import (
    AppliedMoment,
    Codec,
    CommandAck,
    CorrectionHeard,
    Fact,
    GyroSample,
    Sender,
    Speaker,
    TimesyncReply,
    TimesyncRequest,
    profiles,
)
from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes
from dob_companion.mavlink.listener import (
    Heard,
    Listener,
    ParameterHeard,
    Presence,
    VersionHeard,
    stream_request,
)
from dob_companion.mavlink.makes import PX4
from dob_companion.mavlink.signing import Signature, SigningGate
from dob_companion.supervisor import AxisCheck, RoundTrip

HEARTBEAT_S = 1.0
TIMESYNC_S = 0.1
TRIES = 2
"""How often a stream is asked for; then the request counts as unanswered."""

SETTLING_S = 1.0
"""Wall time after the last request before anything is measured: rates change, and queues run empty."""

MOST_STREAMS = 1024
"""Streams kept apart, by sender and message: no vehicle has as many, but anybody may invent senders."""


class Stage(Enum):
    """How far it is."""

    WAITING = "waiting for an autopilot"
    ASKING = "asking for streams"
    READING = "reading parameters"
    SETTLING = "letting streams settle"
    MEASURING = "measuring"
    DONE = "done"


def _nothing(_make: str, _vehicle: str) -> tuple[str, ...]:
    return ()


class Listening:
    """Waits up to `patience` (`seconds`) for an autopilot, asks for what it may deliver, and measures for `seconds`.

    `profile` is the one asked for; the attribute is the one that the autopilot is judged by. `wanted` tells by make and
    kind of vehicle which of the autopilot's parameters are read; `axes` are those in which the vehicle speaks.

    With a gate, whose key the link signs with, signatures are judged as well; what is heard counts in any case.
    """

    def __init__(
        self,
        dt: float,
        seconds: float,
        design: DobDesign | None,
        *,
        now: float = 0.0,
        datagrams: bool = True,
        gate: SigningGate | None = None,
        profile: str = profiles.AUTO,
        wanted: Callable[[str, str], tuple[str, ...]] = _nothing,
        patience: float | None = None,
        axes: VehicleAxes = IN_HOVER,
    ) -> None:
        self.stage = Stage.WAITING
        self.presences: dict[Sender, Presence] = {}
        self.streams: dict[tuple[Sender, str], StreamLog] = {}
        self.answers: dict[str, bool | None] = {}
        self.parameters: dict[str, float] = {}
        self.version: str | None = None
        self.round_trips_s: deque[float] = deque(maxlen=MOST_KEPT)
        self.asked_time = 0
        self.ages: deque[float] = deque(maxlen=MOST_KEPT)
        self.rates_seen: set[tuple[float, float, float]] = set()
        self.finite = True
        self.correctors: set[Sender] = set()
        self.checked = gate is not None
        self.signatures: defaultdict[Sender, Counter[Signature]] = defaultdict(Counter)
        self.system: int | None = None
        self.profile = profiles.at_first(profile)
        self.check = AxisCheck(design) if design else None
        self.axes = axes
        self.rotations = RotationSearch(design) if design else None
        self.clocks = ClockCheck(dt)
        self.listener = Listener(datagrams=datagrams, gate=gate)
        self._dt, self._seconds, self._asked_profile = dt, seconds, profile
        self._round_trip = RoundTrip()
        self._codec, self._speaker = Codec(datagrams=datagrams, axes=axes), Speaker()
        self._requests = StreamRequests(TRIES)
        self._wanted, self._reading = wanted, ParameterReading(())
        self._names: tuple[str, ...] = ()
        self._until = now + (seconds if patience is None else patience)
        self._next_beat = now
        self._next_timesync = float("inf")
        self._pairs = Pairs(design) if design else None
        self._out: list[bytes] = []

    # The four verbs -------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes from the link."""
        for heard in self.listener.hear(data):
            match heard:
                case Presence():
                    self._present(heard)
                case Heard():
                    self._heard(heard, now)
                case ParameterHeard() if self._ours(heard.sender):
                    self._parameter(heard)
                case VersionHeard() if self._ours(heard.sender):
                    self.version = heard.text
        for fact in self._codec.facts(data):
            self._take(fact, now)

    def advance(self, now: float) -> None:
        """Do what is due, and go on to the next stage when this one is over."""
        if now >= self._next_beat:
            self._next_beat = now + HEARTBEAT_S
            self._out.append(self._speaker.heartbeat(fault=False))
        if now >= self._next_timesync:
            self._next_timesync = now + TIMESYNC_S
            self.asked_time += 1
            self._round_trip.asked(asked_ns := round(now * 1e9))
            self._out.append(self._speaker.ask_time(asked_ns))
        if self.stage is Stage.ASKING:
            self._ask(now)
        elif self.stage is Stage.READING:
            self._read(now)
        elif now >= self._until:
            self._next_stage(now)

    def bytes_to_send(self) -> list[bytes]:
        """Messages to send, oldest first; each call empties the list."""
        out, self._out = self._out, []
        for message in out:
            self.listener.said(message)
        return out

    def next_deadline(self) -> float:
        """When `advance` must be called even if nothing comes in."""
        asking = {Stage.ASKING: self._requests.deadline, Stage.READING: self._reading.deadline}
        return min(self._next_beat, self._next_timesync, self._until, asking.get(self.stage, float("inf")))

    # Stages ---------------------------------------------------------------------------------------------------

    @property
    def autopilot(self) -> Presence | None:
        """The autopilot that was listened to."""
        return self.presences.get(Sender(self.system, 1)) if self.system is not None else None

    def _ours(self, sender: Sender) -> bool:
        return self.autopilot is not None and sender == self.autopilot.sender

    def stream(self, name: str) -> StreamLog | None:
        """A stream of the autopilot."""
        return self.streams.get((Sender(self.system, 1), name)) if self.system is not None else None

    def _present(self, presence: Presence) -> None:
        self.presences[presence.sender] = presence
        if self.system is None and presence.make:
            self.system = self._codec.system = self._speaker.system = presence.sender.system
            self.profile = profiles.choose(self._asked_profile, presence.make) or self.profile
            self._codec.profile = self.profile
            fast = [stream.name for stream in self.profile.streams if stream.interval_us is None]
            names = (*fast, *self.profile.also_heard)
            self.answers = dict.fromkeys(names)
            for name in names:
                self._requests.ask(stream_request(name, round(1e6 * self._dt)))
            self.stage, self._until = Stage.ASKING, float("inf")

    def _ask(self, now: float) -> None:
        request = self._requests.due(now)
        if request:
            self._out.append(self._speaker.request(request))
        elif self._requests.deadline == float("inf"):
            make, vehicle = (self.autopilot.make, self.autopilot.vehicle) if self.autopilot else ("", "")
            self._names = self._wanted(make, vehicle)
            self.stage, self._reading = Stage.READING, ParameterReading(self._names)
            if not self._reading.done:
                self._out.append(self._speaker.ask_version())
            self._read(now)

    def _read(self, now: float) -> None:
        self._out += map(self._speaker.read_parameter, self._reading.due(now))
        if self._reading.done:
            self.stage, self._until = Stage.SETTLING, now + SETTLING_S

    def _parameter(self, heard: ParameterHeard) -> None:
        """PX4 sends the bytes of an integer, ArduPilot its value as a real number."""
        whole = self.autopilot is not None and self.autopilot.make == PX4 and heard.bytewise is not None
        value = float(heard.bytewise) if whole and heard.bytewise is not None else heard.value
        if heard.name in self._names and np.isfinite(value):  # others may be downloading them all
            self.parameters[heard.name] = value
        self._reading.told(heard.name)

    def _next_stage(self, now: float) -> None:
        if self.stage is Stage.SETTLING:
            self.streams.clear()
            self.stage, self._until, self._next_timesync = Stage.MEASURING, now + self._seconds, now
            return
        for name in self.answers:
            self._out.append(self._speaker.request(stream_request(name, 0)))
        self.stage, self._until = Stage.DONE, float("inf")
        self._next_timesync = self._next_beat = float("inf")

    # What is heard --------------------------------------------------------------------------------------------

    def _heard(self, heard: Heard, now: float) -> None:
        self.signatures[heard.sender][heard.signature] += 1
        key = (heard.sender, heard.name)
        if key in self.streams or len(self.streams) < MOST_STREAMS:
            self.streams.setdefault(key, StreamLog(heard.name)).add(now, heard.stamp_us, heard.fine)

    def _take(self, fact: Fact, now: float) -> None:
        match fact:
            case CommandAck():
                self._acknowledged(fact, now)
            case TimesyncRequest():
                self._out.append(self._speaker.timesync(fact, round(now * 1e9)))
            case CorrectionHeard():
                self.correctors.add(fact.sender)
            case TimesyncReply() if self.stage is Stage.MEASURING:
                self._time_told(fact, now)
            case GyroSample() if self.stage is Stage.MEASURING:
                self._sample(fact)
            case AppliedMoment() if self.stage is Stage.MEASURING:
                self._moment(fact)

    def _acknowledged(self, ack: CommandAck, now: float) -> None:
        request = self._requests.answered(ack, now)
        if request:
            self.answers[request.name] = ack.accepted

    def _time_told(self, reply: TimesyncReply, now: float) -> None:
        seconds = self._round_trip.answered(reply.ts1_ns, now)
        if seconds is not None:
            self.round_trips_s.append(seconds)

    def _sample(self, sample: GyroSample) -> None:
        self.clocks.gyro(sample.stamp_us)
        self.finite = self.finite and bool(np.all(np.isfinite(sample.rates)))
        if len(self.rates_seen) < 2:
            self.rates_seen.add(sample.rates)
        if self.finite and self._pairs and self.check and self.rotations:
            for pair in self._pairs.gyro(sample):
                for each in (self.check, self.rotations):
                    if pair is None:
                        each.interrupt()
                    else:
                        each.add(*pair)

    def _moment(self, applied: AppliedMoment) -> None:
        self.ages.append(applied.age_samples)
        self.clocks.moment(applied.stamp_us)
        if self._pairs:
            self._pairs.moment(applied)

"""The companion: MAVLink around a loop, the disturbance observer's or another, as a pure object with four verbs.

    receive(data, now)   bytes that have come in
    advance(now)         time has passed
    bytes_to_send()      what is to go out, in order
    next_deadline()      when `advance` wants to be called at the latest

`now` is any monotonic clock in seconds. It serves heartbeats, requests and silence only; whatever shapes a
correction runs on the vehicle's stamps (`dob`), so the companion behaves the same in lockstep.
"""

from collections.abc import Callable, Iterable

from dob_companion.artifact import DobDesign
from dob_companion.companion.config import CompanionConfig
from dob_companion.companion.dob import LONGEST_CLOSING_S
from dob_companion.companion.loop import Loop, Task, observing
from dob_companion.companion.neighbours import Neighbours
from dob_companion.companion.obeyed import Obeyed
from dob_companion.companion.operator import Operator
from dob_companion.companion.outgoing import Outgoing
from dob_companion.companion.parameters import Parameters
from dob_companion.companion.remarks import Remark, Remarks
from dob_companion.companion.status import Event, Status
from dob_companion.companion.streams import WantedStreams
from dob_companion.companion.zeros import Zeros
from dob_companion.mavlink import (
    AppliedMoment,
    Codec,
    CommandAck,
    CommandForUs,
    ComputerLoad,
    CorrectionHeard,
    Fact,
    FileRequest,
    FlightState,
    GyroSample,
    Heartbeat,
    Input,
    ParamRead,
    ParamWrite,
    RcChannels,
    Severity,
    Speaker,
    TimesyncReply,
    TimesyncRequest,
    stream_requests,
)
from dob_companion.mavlink.facts import Axes3
from dob_companion.mavlink.profiles import Profile
from dob_companion.supervisor import State, Transition, ages

HEARTBEAT_S = 1.0
NO_CORRECTION: Axes3 = (0.0, 0.0, 0.0)
TELEMETRY_EVERY = 5
"""Samples between two DEBUG_FLOAT_ARRAY: 50 Hz at 250 Hz."""


class Companion:
    """One companion computer for one vehicle, for a design to be flown or another task.

    `datagrams` tells whether `receive` gets whole datagrams or pieces of a byte stream.
    """

    def __init__(
        self,
        design: DobDesign | Task,
        config: CompanionConfig | None = None,
        *,
        now: float = 0.0,
        datagrams: bool = True,
    ) -> None:
        config = config or CompanionConfig()
        task = design if isinstance(design, Task) else observing(design, config)
        self.newborn: Callable[[], Companion] = lambda: Companion(design, config, now=now, datagrams=datagrams)
        """Builds a companion as this one was before it had heard anything."""
        self.parameters = Parameters(config.parameters, task.limit)
        self.loop: Loop = task.loop(self.parameters)
        self.load = ComputerLoad()
        self.closed = False
        self.vehicle_axes = config.axes
        self._obeyed = Obeyed(config.system, config.profile, now)
        self._carrier = config.correction_message
        self._codec = Codec(profile=self.profile, datagrams=datagrams, axes=self.vehicle_axes)
        self._speaker = Speaker(self._carrier or self.profile.carrier, self.vehicle_axes)
        self._operator = Operator(self.parameters, self._speaker)
        self._new_streams: Callable[[], WantedStreams] = lambda: WantedStreams(
            stream_requests(self.profile, task.dt, kill_switch=config.regime.kill_channel > 0)
        )
        self._streams = self._new_streams()
        self._neighbours = Neighbours()
        self._remarks = Remarks()
        self._zeros = Zeros(task.dt)
        self._greeting = task.greeting
        self._out = Outgoing()
        self._events: list[Event] = []
        self._next_heartbeat = now
        self._now = now
        self._sent = NO_CORRECTION
        self._close_by = float("inf")
        self._untold = 0
        self._answered: int | None = None

    # The four verbs -------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes from the link. Garbage is counted, never raised."""
        self._now = now
        self._follow_up()
        for fact in self._codec.facts(data):
            self._take(fact, now)

    def advance(self, now: float) -> None:
        """Do what is due: what an answer has left over, heartbeats, requests, and fading when samples have stopped."""
        self._now = now
        self._follow_up()
        if now >= self._next_heartbeat:
            self._next_heartbeat = now + HEARTBEAT_S
            self._each_second(now)
        for system, component in self.loop.strangers_gone(now):
            self._say(Severity.NOTICE, f"DOB: {system}/{component} gone, not heard for {ages.STRANGER_S:g} s")
        request = self._streams.due(now)
        if request:
            self._out.put(self._speaker.request(request))
        if now >= self._obeyed.silence_at:
            self._without_samples(now)
        if self.loop.closing and (not self.loop.injecting or now >= self._close_by):
            self._finish(now)
        self._report()

    def bytes_to_send(self) -> list[bytes]:
        """Messages to send, oldest first; each call empties the list."""
        messages, answered_us = self._out.take()
        if answered_us is not None:
            self.loop.answer_left(answered_us)
        return messages

    def next_deadline(self) -> float:
        """When `advance` must be called even if nothing comes in."""
        silence = self._zeros.deadline
        if silence is None:
            silence = self._obeyed.silence_at if self.loop.injecting else float("inf")
        return min(self._next_heartbeat, self._streams.deadline, silence, self._close_by)

    # What the runtime asks besides ----------------------------------------------------------------------------

    @property
    def vehicle(self) -> int | None:
        """System id of the vehicle that is obeyed; None while none has been heard."""
        return self._obeyed.system

    def may_bring_sample(self, data: bytes) -> bool:
        """Whether a gyro sample may be in these bytes. When several pieces have come in, nothing should be sent before
        the last such piece was received: of a backlog only the newest samples are answered."""
        return self._codec.may_bring_sample(data)

    @property
    def profile(self) -> Profile:
        """What the vehicle is flown by; the one at first while none has been heard."""
        return self._obeyed.profile

    @property
    def next_sample(self) -> float:
        """When the next gyro sample is to be expected."""
        return self._obeyed.gyro_at + self.loop.dt

    def close(self, now: float) -> None:
        """Begin to leave: fade out, then a zero as the last message, then `closed` is True."""
        if not self.loop.closing:
            self.loop.closing = True
            self._close_by = now + min(self.parameters["DOB_RAMP_S"], LONGEST_CLOSING_S) + 10 * self.loop.dt
            self.loop.operator_wrote()

    def events(self) -> list[Event]:
        """What has happened since the last call."""
        events, self._events = self._events, []
        return events

    def status(self) -> Status:
        """The moment, for whoever shows it."""
        figures, counters = self.loop.figures(), self._codec.counters
        if self._obeyed.silent(self._now):
            figures = figures.without_samples()
        return Status(
            state=self.loop.state,
            why=self.loop.why,
            rate_hz=figures.rate_hz,
            delay_samples=figures.delay_samples,
            delay_p95_samples=figures.delay_p95_samples,
            round_trip_s=figures.round_trip_s,
            d_hat=figures.d_hat,
            correction=self._sent,
            stepped=figures.stepped,
            bridged=figures.bridged,
            gaps=figures.gaps,
            late=figures.late,
            bad=counters.bad,
            foreign=counters.foreign,
            heard_s=self._obeyed.heard_s(self._now),
        )

    # Facts ----------------------------------------------------------------------------------------------------

    def _take(self, fact: Fact, now: float) -> None:
        match fact:
            case GyroSample():
                self._gyro(fact, now)
            case AppliedMoment():
                self._streams.heard(Input.MOMENT, fact.stamp_us)
                self.loop.moment(fact)
            case Heartbeat():
                self._heartbeat(fact, now)
            case FlightState():
                self._streams.heard(Input.FLIGHT_STATE)
                self.loop.flight_state(fact, now)
            case RcChannels():
                self._streams.heard(Input.RC_CHANNELS)
                self.loop.rc_channels(fact.pulses_us, now)
            case CorrectionHeard():
                self._correction_heard(fact, now)
            case ParamWrite() | ParamRead():
                self._out.put(*self._operator.answer(fact))
                self._events += map(Event.info, self._operator.words())
                self.loop.operator_wrote()
                self._report()
            case CommandAck():
                self._acknowledged(fact, now)
            case CommandForUs():
                self._out.put(self._speaker.unsupported(fact))
            case TimesyncReply():
                self.loop.time_answered(fact.ts1_ns, now)
            case FileRequest():
                self._out.put(self._speaker.no_file(fact))
            case TimesyncRequest():
                self._out.put(self._speaker.timesync(fact, round(now * 1e9)))

    def _gyro(self, sample: GyroSample, now: float) -> None:
        self._streams.heard(Input.GYRO, sample.stamp_us)
        repeat = sample.stamp_us == self.loop.newest_us
        answer = self.loop.gyro(sample, now)
        if answer is None:
            return
        self._obeyed.gyro_at = now
        self._zeros.over()
        self._out.leave_out_before(self.loop.too_old_before(sample.stamp_us))
        self._out.answer(answer, self._speaker.correction(answer.stamp_us, answer.correction))
        self._sent = answer.correction
        if not repeat:
            self._answered = sample.stamp_us

    def _follow_up(self) -> None:
        """What comes after an answer, when that has left: the loop's own measuring, telemetry, words."""
        stamp_us, self._answered = self._answered, None
        if stamp_us is None:
            return
        self.loop.follow_up()
        self._untold += 1
        if self._untold >= TELEMETRY_EVERY:
            self._untold = 0
            self._tell(stamp_us)
        self._report()

    def _tell(self, stamp_us: int) -> None:
        """Telemetry."""
        status = self.status()
        values = (*status.d_hat, *status.correction, status.state, status.delay_samples, status.rate_hz)
        self._out.put(self._speaker.telemetry(stamp_us, values))

    def _heartbeat(self, beat: Heartbeat, now: float) -> None:
        if not beat.make:
            return
        if beat.system != self.vehicle and self._obeyed.may_become(beat.system, now, injecting=self.loop.injecting):
            profile = self._obeyed.profile_for(beat)
            if profile is None:
                if why := self._obeyed.refuse(beat):
                    self._events.append(Event(Severity.WARNING, why))
                return
            self._meet(beat.system, profile, now)
        if beat.system == self.vehicle:
            self._obeyed.beat(now, simulated=beat.simulated)
            standing_by = beat.status in self.profile.landed.standing_by
            self.loop.heartbeat(beat.armed, now, standing_by=standing_by)
        else:
            self._stranger(beat.system, beat.component, now)

    def _meet(self, system: int, profile: Profile, now: float) -> None:
        before = self.vehicle
        self._obeyed.system = self._codec.system = self._speaker.system = system
        if profile is not self.profile:
            self._obeyed.profile = self._codec.profile = profile
            self._streams = self._new_streams()
            self._speaker.carry(self._carrier or profile.carrier)
        self._neighbours.we_are(system)
        self._streams.start(now)
        self._say(Severity.INFO, self._greeting)
        turned = f", axes {self.vehicle_axes}" if str(self.vehicle_axes) else ""
        self._events.append(Event.info(f"vehicle heard: system {system}, profile {profile.name}{turned}"))
        if before is not None:
            self._leave(before, now)

    def _leave(self, before: int, now: float) -> None:
        """Another vehicle in the place of the one `before`: off, and everything is measured anew."""
        self.parameters.switch_off()
        state, self.loop = self.loop.state, self.loop.for_another_vehicle()
        change = Transition(state, self.loop.state, "another vehicle")
        self.parameters.publish_state(self.loop.state)
        self._obeyed.gyro_at, self._answered = now, None
        self._zeros.over()
        self._out.put(self._operator.value("DOB_ENABLE"))
        self._say(Severity.WARNING, f"DOB: system {before} silent for {ages.VEHICLE_S:g} s, obey {self.vehicle}")
        if change.source is not change.target:
            self._say_change(change)

    def _correction_heard(self, heard: CorrectionHeard, now: float) -> None:
        if self._neighbours.injects(heard, self.loop.echo):
            self._stranger(heard.sender.system, heard.sender.component, now)

    def _stranger(self, system: int, component: int, now: float) -> None:
        if self.loop.stranger(system, component, now):
            self._say(Severity.WARNING, f"DOB: another controller on the link: {system}/{component}")

    def _acknowledged(self, ack: CommandAck, now: float) -> None:
        if refused := self._streams.answered(ack, now):
            self._say(Severity.WARNING, f"DOB: {refused}"[:50])

    # Time -----------------------------------------------------------------------------------------------------

    def _each_second(self, now: float) -> None:
        self._out.put(self._speaker.heartbeat(fault=self.loop.state is State.FAULT))
        self._operator.each_second()
        self._events += map(Event.info, self._operator.words())
        if self.vehicle is None:
            return
        newest_us, silent = self.loop.newest_us or 0, self._obeyed.silent(now)
        asked_ns = round(now * 1e9)
        self.loop.time_asked(asked_ns, now)
        self._out.put(self._speaker.ask_time(asked_ns))
        self._out.put(self._speaker.computer_status(newest_us, self.load))
        for words in self._streams.judge(now, newest_us * 1e-6, silent=silent):
            self._say(Severity.WARNING, f"DOB: {words}"[:50])
        if silent and newest_us:  # or a ground station would go on showing what was told last
            self._tell(newest_us)
        self._remark(self._remarks.each_second(self.loop, now))

    def _without_samples(self, now: float) -> None:
        """Silence: the vehicle has faded by itself, and zeros tell it that this was the end of it."""
        if self.loop.injecting:
            self._zeros.begin(now)
        self.loop.silent()
        for found_at, later in self._zeros.due(now):
            self._zero(found_at, later)

    def _zero(self, now: float, later: int = 0) -> None:
        """A zero under the stamp that a sample would bear by `now`, or so many samples later."""
        newest = self.loop.newest_us
        if newest is not None:
            missed = int((now - self._obeyed.gyro_at) / self.loop.dt) + later
            stamp = newest + missed * round(1e6 * self.loop.dt)
            self._sent = NO_CORRECTION
            self.loop.zero_sent(stamp)
            self._out.put(self._speaker.correction(stamp, NO_CORRECTION))

    def _finish(self, now: float) -> None:
        if not self.closed:
            self._zero(now)
        self.closed = True

    # Words ----------------------------------------------------------------------------------------------------

    def _report(self) -> None:
        self._remark(self._remarks.clocks(self.loop.clock_offset_s))
        for change in self.loop.take_transitions():
            self._remarks.changed(change.reason)
            self._say_change(change)

    def _remark(self, remarks: Iterable[Remark]) -> None:
        for severity, text in remarks:
            self._say(severity, text)

    def _say_change(self, change: Transition) -> None:
        severity = Severity.CRITICAL if change.target is State.FAULT else Severity.NOTICE
        self._say(severity, f"DOB {change.target.name}: {change.reason}", change)

    def _say(self, severity: Severity, text: str, change: Transition | None = None) -> None:
        self._out.put(self._speaker.text(severity, text))
        self._events.append(Event(severity, text, change))

"""The loop of an excitation: stamped facts in, one answer per gyro sample out, as the observer's (`companion.dob`).

Nothing is fed back: an answer is the signal's value at the sample's stamp, faded, and zero unless an axis is excited.
It waits until all is well for a while, excites one axis after another with rests between, and ends. From the first
axis on whatever is not well ends it for good: where it is grave the value sent last fades within 0.1 s, else the
signal fades within DOB_RAMP_S. Nothing begins again.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from dob_companion.companion.dob import EMERGENCY_RAMP_S, JUDGE_EVERY, LONGEST_CLOSING_S, Answer
from dob_companion.companion.linked import NOTHING, LinkedLoop
from dob_companion.companion.parameters import Parameters
from dob_companion.companion.samples import Arrival, Inputs, Samples
from dob_companion.excitation.delays import Delays
from dob_companion.excitation.limits import Guard, Probe, Reason
from dob_companion.excitation.plan import AxisPlan, Passage, Plan
from dob_companion.mavlink import AppliedMoment, GyroSample
from dob_companion.mavlink.facts import Axes3
from dob_companion.observer import Missing
from dob_companion.supervisor import (
    Conditions,
    CorrectionShaper,
    Echo,
    FlightRegime,
    LinkGate,
    RegimeLimits,
    State,
    Transition,
)
from dob_companion.supervisor.health import Saturation

MISSING = Missing(samples=5, moments=10)
"""Samples in a row that a record bears: what acted is told by the vehicle, and no answer depends on it."""

DELAY_SAMPLES = MARGIN_SAMPLES = 8
"""The delay of the link changes nothing that is measured; only the vehicle's time-out bounds it."""

REST_S = 1.0
"""Vehicle time for which all must have been well before an axis begins: the one before has come to rest."""

TAIL_S = 0.5
"""Zeros for so long after the end."""

COMPLETE, ABORTED = "complete", "aborted: "


class ExcitationLoop(LinkedLoop):
    """See `companion.loop.Loop`; `guard` takes besides what limits the aircraft.

    outcome   "" until it has ended, then "complete" or "aborted: " and why
    passages  the axes that were excited, in order
    delays    how late what was sent acted while they were
    """

    def __init__(self, plan: Plan, parameters: Parameters, limits: RegimeLimits | None = None) -> None:
        self._newborn: Callable[[], ExcitationLoop] = lambda: ExcitationLoop(plan, parameters, limits)
        settings = parameters.settings
        super().__init__(
            plan.dt,
            LinkGate(1.0 / plan.dt, DELAY_SAMPLES, MARGIN_SAMPLES),
            Samples(plan.dt, MISSING, _AsBefore()),
            CorrectionShaper(settings.axes, settings.gain, settings.limit),
        )
        self.outcome = ""
        self.passages: list[Passage] = []
        self.answer: Answer | None = None
        self.guard = Guard(plan.limits)
        self.delays = Delays()
        self._regime = FlightRegime(limits or RegimeLimits())
        self._plan, self._parameters = plan, parameters
        self._probe = Probe(plan.limits.rate)
        self._echo = Echo(plan.dt)
        self._saturation = Saturation(plan.dt)
        self._settled, self._data_why = 0, "no samples yet"
        self._well_since: int | None = None
        self._ended_us: int | None = None
        self._at_once = False
        self._answered: int | None = None
        self._count = 0

    # What is asked of it --------------------------------------------------------------------------------------

    @property
    def why(self) -> str:
        """What speaks against exciting, in words; "" when nothing does."""
        reason = _gravest(*self._checks())
        return reason.text if reason else ""

    @property
    def regime(self) -> FlightRegime:
        """Whether the aircraft flies, and who else is on the link."""
        return self._regime

    @property
    def echo(self) -> Echo:
        """The record of what we have sent."""
        return self._echo

    @property
    def over(self) -> bool:
        """It has ended, and zeros have been said for a while since."""
        newest, ended = self.newest_us, self._ended_us
        if not self.outcome or self.injecting:
            return False
        if not self.passages or newest is None or not self._data_good:
            return True
        return self._running is None and ended is not None and newest - ended >= 1e6 * TAIL_S

    @property
    def progress(self) -> tuple[str, float] | None:
        """The axis that is excited and how much of its time has passed, 0…1; None between axes."""
        passage, newest = self._running, self.newest_us
        if passage is None or newest is None:
            return None
        return passage.axis, min(1.0, 1e-6 * (newest - passage.begin_us) / self._plan.signal.seconds)

    def for_another_vehicle(self) -> "ExcitationLoop":
        """A loop for another vehicle: one that was begun on this one does not go on there."""
        loop = self._newborn()
        loop._echo, loop.closing = self._echo, self.closing
        if self.passages:
            loop.abort(Reason("another vehicle"))
        return loop

    def abort(self, reason: Reason) -> None:
        """End it, begun or not; what acts fades."""
        self._ends(reason)
        if not self.injecting:
            self._judge(self.newest_us or 0)

    # Facts ----------------------------------------------------------------------------------------------------

    def operator_wrote(self) -> None:
        """A parameter has changed: an "off" ends it, also when no samples come."""
        self._heed()
        if not self.injecting:
            self._judge(self.newest_us or 0)

    def silent(self) -> None:
        """No sample has come for longer than the vehicle holds a correction: it has none of ours any more."""
        self._settled, self._data_why = 0, "no samples"
        self.shaper.drop()
        self._judge(self.newest_us or 0)

    def gyro(self, sample: GyroSample, now: float) -> Answer | None:
        """Answer a gyro sample; None when it is late. `now`: wall, s."""
        self.follow_up()
        self._now, stamp_us = now, sample.stamp_us
        known = self.samples.known(stamp_us)
        if known:
            return self.answer if known is Arrival.REPEAT else None
        if self.samples.restarted(stamp_us):
            self._restart()
        if not _finite(sample.rates):
            self.samples.spoil_gyro(stamp_us)
            self._spoil("gyro rate not finite")
        else:
            self._take(sample)
        self.answer = self._reply(stamp_us)
        self._answered = stamp_us
        return self.answer

    def follow_up(self) -> None:
        """What the last answer did not depend on, if that has not been done yet."""
        stamp_us, self._answered = self._answered, None
        if stamp_us is None or self.answer is None:
            return
        self._echo.sent(stamp_us, self.answer.correction)
        self.gate.rate.add(stamp_us, self.samples.lost)
        self._count += 1
        if self._count % JUDGE_EVERY == 0:
            self.gate.judge(stamp_us)

    def moment(self, applied: AppliedMoment) -> None:
        """Take the applied moment of a sample, and the age of our part in it."""
        self.follow_up()
        if not _finite(applied.moment):
            self._spoil("applied moment not finite")
            return
        if self.samples.moment(applied.stamp_us, applied.moment) is None:
            return
        self.regime.throttle(applied.thrust)
        self._saturation.add(applied.moment)
        samples = self._aged(applied)
        if self._running is not None:
            self.delays.add(samples, reported=not math.isnan(applied.age_samples))
        if self._echo.foreign(applied.stamp_us, applied.age_samples, applied.moment, applied.correction):
            self.abort(Reason("corrections come back changed"))

    # What is well and what is not -----------------------------------------------------------------------------

    @property
    def _data_good(self) -> bool:
        return self._settled * self.dt >= REST_S and not self.samples.clocks.why

    @property
    def _wish(self) -> bool:
        return self._parameters.settings.enable and not self.closing and not self.outcome

    @property
    def _running(self) -> Passage | None:
        return self.passages[-1] if self.passages and self.passages[-1].end_us is None else None

    @property
    def _axis(self) -> AxisPlan | None:
        """The axis that is excited or comes next."""
        at = len(self.passages) - (self._running is not None)
        return self._plan.axes[at] if at < len(self._plan.axes) else None

    def _checks(self) -> tuple[str, str, str, Reason | None]:
        """What speaks against exciting: data, link, flight and a limit."""
        data = self.samples.clocks.why or ("" if self._data_good else self._data_why)
        link = "" if self.gate.good else self.gate.why
        limit = Reason("moment at its stops") if self._saturation.excessive else self.guard.broken(self._now)
        return data, link, self.regime.why_not(self._now), limit

    def _take(self, sample: GyroSample) -> None:
        arrived = self.samples.gyro(sample.stamp_us, sample.rates)
        seconds = 1e-6 * sample.stamp_us
        self.regime.vehicle_time(seconds)
        self.guard.vehicle_time(seconds)
        self.guard.rates(sample.rates)
        if arrived.arrival is Arrival.GAP:
            self._settled, self._data_why = 0, "gap in samples" if self.answer else "settling"
        self._settled += 1

    def _restart(self) -> None:
        """The vehicle's clock has jumped back: it holds nothing of ours any more."""
        self.gate.clear()
        self.regime.forget()
        self.shaper.drop()
        self._settled, self._data_why = 0, "vehicle clock jumped back"
        self._well_since = None

    def _spoil(self, why: str) -> None:
        self.shaper.drop()
        self.samples.spoil()
        self._settled, self._data_why = 0, why
        self._end(Reason(why))

    def _end(self, reason: Reason) -> None:
        """What ends it once it has begun, and is waited for before."""
        if self.passages:
            self._ends(reason)

    def _ends(self, reason: Reason) -> None:
        """The first reason is the one that is told; the gravest says how fast it fades."""
        self.outcome = self.outcome or ABORTED + reason.text
        self._at_once = self._at_once or reason.at_once

    def _heed(self) -> None:
        """The operator's wish is gone: it ends."""
        if not self._wish and not self.outcome:
            self.outcome = ABORTED + ("stopped" if self.closing else "switched off")

    # The answer -----------------------------------------------------------------------------------------------

    def _reply(self, stamp_us: int) -> Answer:
        if self.gate.broken(stamp_us):
            self.shaper.drop()
        self._judge(stamp_us)
        asked, passage, axis = self._parameters.settings, self._running, self._axis
        ramp_s = min(asked.ramp_s, LONGEST_CLOSING_S) if self.closing else asked.ramp_s
        step = f_step = self._step(ramp_s)
        samples = 0.0 if passage is None else (stamp_us - passage.begin_us) / (1e6 * self.dt)
        f = 0.0
        if passage is not None and self.state in (State.RAMP_IN, State.ACTIVE):
            f = self._probe.target(samples * self.dt, self.shaper.f, self.guard.rate)
            passage.level = self._probe.level
        elif self._at_once:
            f_step = self._step(min(ramp_s, EMERGENCY_RAMP_S))
        self.shaper.move(f, f_step, asked.axes, asked.gain, asked.limit, step)
        if passage is None or axis is None:
            return Answer(stamp_us, NOTHING)
        if self._at_once:
            return Answer(stamp_us, self.shaper.hold())
        moment = [0.0, 0.0, 0.0]
        moment[axis.index] = -axis.at(samples)  # a correction is minus what it is shaped from
        return Answer(stamp_us, self.shaper.shape((moment[0], moment[1], moment[2])))

    def _step(self, ramp_s: float) -> float:
        return self.dt / ramp_s if ramp_s > self.dt else 1.0

    def _judge(self, stamp_us: int) -> None:
        data, link, flight, limit = self._checks()
        reason = _gravest(data, link, flight, limit)
        if reason:
            self._end(reason)
        self._heed()
        self._rest(stamp_us, well=reason is None)
        f, waits = self.shaper.f, self._waits(stamp_us)
        change = self.supervisor.judge(
            Conditions(
                wish=self._wish,
                fault=False,
                data=not data,
                link=not link,
                flight=not flight,
                model=limit is None and not waits,
                faded_in=self._probe.level is not None and f == self._probe.level,
                faded_out=f == 0.0,
                why=reason.text if reason else waits,
            )
        )
        if change:
            self._changed(change, stamp_us)

    def _rest(self, stamp_us: int, *, well: bool) -> None:
        if not well or self._running is not None or self.guard.listening(self._now):
            self._well_since = None
        elif self._well_since is None:
            self._well_since = stamp_us

    def _waits(self, stamp_us: int) -> str:
        """Why no axis is to be excited now although all is well; "" when one is."""
        axis, passage = self._axis, self._running
        if passage is not None:
            fade_s = self._parameters.settings.ramp_s
            left_s = self._plan.signal.seconds - 1e-6 * (stamp_us - passage.begin_us)
            return f"{passage.axis} is done" if left_s <= fade_s else ""
        if axis is None:
            return "all axes are done"
        if self._well_since is None or stamp_us - self._well_since < 1e6 * REST_S:
            return f"rests before {axis.name}"
        return ""

    def _changed(self, change: Transition, stamp_us: int) -> None:
        passage, axis = self._running, self._axis
        match change.target:
            case State.RAMP_IN if axis is not None:
                if not self.passages:
                    self.guard.begin()
                self.passages.append(Passage(axis.name, axis.amplitude, stamp_us))
                self._probe = Probe(self._plan.limits.rate)
                change = replace(change, reason=f"{axis.name} begins")
            case State.RAMP_OUT if self.outcome:
                change = replace(change, reason=self.outcome)
            case State.DISABLED if self.outcome:
                change = replace(change, reason=self.outcome)
        if change.source is State.RAMP_OUT and passage is not None:
            passage.end_us, passage.complete = stamp_us, not self.outcome
            self._ended_us = stamp_us
            if self._axis is None and not self.outcome:
                self.outcome = COMPLETE
        self._transitions.append(change)
        self._parameters.publish_state(self.state)


class _AsBefore:
    """What stands for samples that are missing, where nothing is computed from them."""

    def bridge(self, _first: Axes3, moments: Sequence[Axes3], last: Axes3, _beyond: float) -> list[Axes3]:
        """The last rates."""
        return [last] * len(moments)

    def expect(self, finished: Sequence[Inputs], _moment: Axes3) -> Axes3:
        """The rates before."""
        return finished[-1][0] if finished else NOTHING


def _gravest(data: str, link: str, flight: str, limit: Reason | None) -> Reason | None:
    text = data or link or flight
    return Reason(text) if text else limit


def _finite(values: Axes3) -> bool:
    return math.isfinite(values[0]) and math.isfinite(values[1]) and math.isfinite(values[2])

"""The disturbance observer loop of one vehicle: stamped facts in, one answer per gyro sample out.

No MAVLink and no wall time in here: everything that shapes a correction runs on the vehicle's stamps.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from dob_companion.artifact import DobDesign
from dob_companion.companion.linked import NOTHING, LinkedLoop
from dob_companion.companion.parameters import Parameters
from dob_companion.companion.samples import AHEAD, Arrival, Arrived, Inputs, Samples, revisable
from dob_companion.companion.watch import Watch
from dob_companion.mavlink import AppliedMoment, GyroSample
from dob_companion.mavlink.facts import Axes3
from dob_companion.observer import GyroModel, ObserverBank, StrongWind, missing_samples
from dob_companion.supervisor import (
    Conditions,
    CorrectionShaper,
    Echo,
    FirstEnabling,
    FlightRegime,
    LinkGate,
    RegimeLimits,
    State,
    Steps,
)

SETTLING_TIMES = 5.0
"""Slowest modes of the observer that pass before its estimate counts: the zero state is then forgotten to 1 %."""

LEAST_SETTLING_S = 0.1
LONGEST_CLOSING_S = 0.5
"""A correction is faded for so long at most when the companion leaves, whatever the operator's ramp is."""

EMERGENCY_RAMP_S = 0.1
"""An oscillation that we drive is faded in so long, where DOB_RAMP_S is longer; nothing else is."""

JUDGE_EVERY = 25
"""Samples between two judgements of the link (0.1 s at 250 Hz)."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The correction that answers the gyro sample of `stamp_us`: normalized torque, hover axes."""

    stamp_us: int
    correction: Axes3


class DobLoop(LinkedLoop):
    """Observer, supervisor and fades of one vehicle.

    `gyro` and `moment` take facts as they arrive, `answer_left` that an answer is on its way; `silent` ends a
    correction when samples have stopped. `transitions` collects changes of state until they are taken with
    `take_transitions`.

    An answer is wanted at once, so `gyro` does only what it depends on. `follow_up` does the rest, the measuring of
    link and plant, when the answer has left; what that finds counts from the next sample on. Who does not call it
    loses nothing but time: the next fact does.
    """

    def __init__(
        self,
        design: DobDesign,
        parameters: Parameters,
        limits: RegimeLimits | None = None,
        first_enabling: FirstEnabling | None = None,
    ) -> None:
        slowest = max(block.certificate.slowest_mode_s for block in design.blocks)
        delay = min(block.delay_samples for block in design.blocks)
        p95 = min(block.delay_samples + block.certificate.delay_margin_samples for block in design.blocks)
        self._newborn: Callable[[], DobLoop] = lambda: DobLoop(design, parameters, limits, first_enabling)
        settings, missing = parameters.settings, missing_samples(design)
        self._model = GyroModel(design, longest=AHEAD, revisable=revisable(missing))
        self._observer = ObserverBank(design, revisable=revisable(missing))
        self._strong_wind = StrongWind(design, revisable=revisable(missing))
        super().__init__(
            design.dt,
            LinkGate(1.0 / design.dt, delay, p95 - delay),
            Samples(design.dt, missing, self._model),
            CorrectionShaper(settings.axes, settings.gain, settings.limit, memory=round(EMERGENCY_RAMP_S / design.dt)),
        )
        self.watch = Watch(design, limits or RegimeLimits())
        self._steps = Steps(first_enabling or FirstEnabling(), design.dt)
        self.answer: Answer | None = None
        self._parameters = parameters
        self._settling = math.ceil(max(SETTLING_TIMES * slowest, LEAST_SETTLING_S) / design.dt)
        self._settled = 0
        self._fault = ""
        self._emergency = False
        self._data_why = "no samples yet"
        self._samples = 0
        self._finished: tuple[Inputs, ...] | None = None
        self._judged: tuple[object, ...] | None = None

    @property
    def why(self) -> str:
        """What speaks against injecting, in words; "" when nothing does."""
        return next(filter(None, self._reasons()), "")

    @property
    def regime(self) -> FlightRegime:
        """Whether the aircraft flies, and who else is on the link."""
        return self.watch.regime

    @property
    def echo(self) -> Echo:
        """The record of what we have sent."""
        return self.watch.echo

    def for_another_vehicle(self) -> "DobLoop":
        """A loop for another vehicle in the place of this one: everything is measured anew, but what we sent stays
        ours, and who was leaving leaves."""
        loop = self._newborn()
        loop.watch.echo, loop.closing = self.echo, self.closing
        return loop

    def gyro(self, sample: GyroSample, now: float) -> Answer | None:
        """Answer a gyro sample; None when it is late and nothing is to be said. `now` (wall, s) ages heartbeats."""
        if self._finished is not None:
            self.follow_up()
        self._now = now
        known = self.samples.known(sample.stamp_us)
        if known:  # a repeat is answered as before, a late one not at all
            return self.answer if known is Arrival.REPEAT else None
        if self.samples.restarted(sample.stamp_us):
            self._restart()
        if not _finite(sample.rates):
            self.samples.spoil_gyro(sample.stamp_us)
            return self._spoiled(sample.stamp_us, "gyro rate not finite")
        arrived = self.samples.gyro(sample.stamp_us, sample.rates)
        self.regime.vehicle_time(sample.stamp_us * 1e-6)
        if arrived.arrival is Arrival.GAP:
            self._fade_from_here(arrived)
            self._start_anew("gap in samples" if self.answer else "observer settling")
            arrived = arrived._replace(finished=())
        for rates, moment in arrived.finished:
            self._observer.advance(rates, moment)
        estimate = self._observer.estimate(arrived.rates)
        if not _finite(estimate):
            return self._spoiled(sample.stamp_us, "estimate not finite")
        self.d_hat = estimate
        self._settled += 1
        if self._data_good:
            broken = self.watch.bounds.broken(estimate)
            self._latch(broken if self.injecting else "")
        self.answer = self._reply(sample.stamp_us)
        self._finished = arrived.finished
        return self.answer

    def follow_up(self) -> None:
        """What the last answer did not depend on, if that has not been done yet."""
        finished, answer = self._finished, self.answer
        if finished is None or answer is None:
            return
        self._finished = None
        self.watch.echo.sent(answer.stamp_us, answer.correction)
        for inputs in finished:
            self._model.advance(*inputs)
            self.watch.finished(inputs, self._strong_wind.advance(*inputs))
        self.gate.rate.add(answer.stamp_us, self.samples.lost)
        self._samples += 1
        if self._samples % JUDGE_EVERY == 0:
            self.gate.judge(answer.stamp_us)
            self._rings(self.watch.judge(self.injecting))

    def moment(self, applied: AppliedMoment) -> None:
        """Take the applied moment of a sample, whose step it completes, and the age of our part in it."""
        if self._finished is not None:
            self.follow_up()
        if not _finite(applied.moment):
            self._fail("applied moment not finite")
            return
        revisions = self.samples.moment(applied.stamp_us, applied.moment, applied.correction, applied.read_late_us)
        if revisions is not None:
            for revision in revisions:
                self._observer.revise(*revision)
                self._model.revise(*revision)
                self._strong_wind.revise(*revision)
            if inputs := self.samples.foreseen():
                self._observer.foresee(*inputs)
            self._aged(applied)
            self._latch(self.watch.applied(applied))
            self._rings(self.watch.growing)

    def operator_wrote(self) -> None:
        """A parameter has changed: an "off" clears a fault, and the state follows even when no samples come."""
        if not self._wish:
            self._fault = ""
        if not self.injecting:
            self._judge()

    def silent(self) -> None:
        """No sample has come for longer than the vehicle holds a correction: it has none of ours any more."""
        self._settled, self._data_why = 0, "no samples"
        self.shaper.drop()
        self._judge()

    def _reply(self, stamp_us: int) -> Answer:
        if self.gate.broken(stamp_us):
            self.shaper.drop()
        self._judge()
        asked, state = self._parameters.settings, self.supervisor.state
        if self.regime.down:
            self._steps.forget()
        f = self._steps.target(self.shaper.f, state is State.ACTIVE or state is State.RAMP_IN)
        ramp_s = min(asked.ramp_s, LONGEST_CLOSING_S) if self.closing else asked.ramp_s
        step = f_step = self._step(ramp_s)
        if self._emergency:
            f, f_step = 0.0, self._step(min(ramp_s, EMERGENCY_RAMP_S))
        self.shaper.move(f, f_step, asked.axes, asked.gain, asked.limit, step)
        return Answer(stamp_us, self._correction())

    def _correction(self) -> Axes3:
        if self._emergency:
            self._emergency = self.injecting
            return self.shaper.let_go()
        trusted = self._data_good and not self._fault
        return self.shaper.shape(self.d_hat) if trusted else self.shaper.hold()

    def _step(self, ramp_s: float) -> float:
        return self.dt / ramp_s if ramp_s > self.dt else 1.0

    def _judge(self) -> None:
        reasons, f = self._reasons(), self.shaper.f
        true_now = (self._wish, reasons, f == 1.0, f == 0.0)
        if true_now == self._judged:  # the table has no exit for this: it was asked at an earlier sample
            return
        fault, data, link, flight, model = reasons
        change = self.supervisor.judge(
            Conditions(
                wish=self._wish,
                fault=bool(fault),
                data=not data,
                link=not link,
                flight=not flight,
                model=not model,
                faded_in=f == 1.0,
                faded_out=f == 0.0,
                why=next(filter(None, reasons), ""),
            )
        )
        self._judged = None if change else true_now
        if change:
            self._transitions.append(change)
            self._parameters.publish_state(self.state)

    def _reasons(self) -> tuple[str, str, str, str, str]:
        """What speaks against injecting: fault, data, link, flight, model, the gravest first; "" for nothing."""
        return (
            self._fault,
            self.samples.clocks.why or ("" if self._data_good else self._data_why),
            "" if self.gate.good else self.gate.why,
            self.regime.why_not(self._now),
            self.watch.model_why,
        )

    @property
    def _wish(self) -> bool:
        return self._parameters.settings.enable and not self.closing

    @property
    def _data_good(self) -> bool:
        return self._settled >= self._settling and not self.samples.clocks.why

    def _latch(self, fault: str) -> None:
        """A fault matters, and stays, when the operator wants to inject."""
        if fault and self._wish and not self._fault:
            self._fault = fault

    def _restart(self) -> None:
        """The vehicle's clock has jumped back: one that has started anew holds no correction that could be faded."""
        self.gate.clear()
        self.regime.forget()
        self.shaper.drop()
        self._steps.forget()
        self._start_anew("vehicle clock jumped back")

    def _fade_from_here(self, gap: Arrived) -> None:
        """A gap ends a correction; its fade begins from no more than what the samples on both sides of it make likely,
        since what was sent last may be older than any estimate that could be answered for."""
        for rates, moment in gap.finished:
            self._observer.advance(rates, moment)
        estimate = self._observer.estimate(gap.rates)
        if gap.finished and _finite(estimate):
            self.shaper.lower(estimate)

    def _rings(self, why: str) -> None:
        """The loop that we close rings. It is opened at once, also while the correction fades for another reason."""
        if why and self.injecting:
            self._emergency = True
            self._latch(why)

    def _start_anew(self, why: str) -> None:
        self._observer.reset()
        self._model.reset()
        self._strong_wind.reset()
        self.watch.start_anew()
        self._settled, self._data_why = 0, why

    def _spoiled(self, stamp_us: int, why: str) -> Answer:
        self._fail(why)
        self.answer = self._reply(stamp_us)
        self.watch.echo.sent(stamp_us, self.answer.correction)
        return self.answer

    def _fail(self, why: str) -> None:
        """Something is not finite: zero at once, forget everything, latch a fault if it mattered."""
        self.shaper.drop()
        self._start_anew(why)
        self.samples.spoil()
        self.d_hat = NOTHING
        self._latch(why)


def _finite(values: Axes3) -> bool:
    return math.isfinite(values[0]) and math.isfinite(values[1]) and math.isfinite(values[2])

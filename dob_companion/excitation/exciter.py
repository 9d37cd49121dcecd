"""A companion whose task is an excitation: it speaks as one that corrects does, so the vehicle takes what it says."""

from collections.abc import Callable
from dataclasses import replace

from dob_companion import __version__
from dob_companion.companion import Companion, CompanionConfig, Event
from dob_companion.companion.loop import Task
from dob_companion.excitation.limits import Reason
from dob_companion.excitation.loop import ExcitationLoop
from dob_companion.excitation.plan import Plan
from dob_companion.mavlink import Altitude, Attitude, Battery, Fact, Heartbeat, Severity, Watched
from dob_companion.mavlink.profiles import Profile
from dob_companion.mavlink.profiles.watched import watching


class Exciter(Companion):
    """Excites one vehicle by a plan, then is `closed`; `excitation.outcome` says how it ended.

    begin_by  wall time in s by which the first axis must have begun
    trouble   asked in every turn: why the record cannot be kept, in words, or ""

    Of the configuration the start values of parameters are left out: DOB_ENABLE is 1 from the begin, and its being
    written 0 ends it. DOB_AXES, DOB_GAIN, DOB_LIMIT and DOB_RAMP_S mean what they do for a correction.
    """

    def __init__(
        self,
        plan: Plan,
        config: CompanionConfig | None = None,
        *,
        now: float = 0.0,
        datagrams: bool = True,
        begin_by: float = float("inf"),
        trouble: Callable[[], str] = lambda: "",
    ) -> None:
        config = config or CompanionConfig()
        limit = max(axis.amplitude for axis in plan.axes)
        task = Task(
            plan.dt,
            limit,
            f"dob-companion {__version__} excites {', '.join(axis.name for axis in plan.axes)}",
            lambda parameters: ExcitationLoop(plan, parameters, config.regime),
        )
        super().__init__(task, replace(config, parameters={"DOB_ENABLE": 1.0}), now=now, datagrams=datagrams)
        self.newborn = lambda: Exciter(plan, config, now=now, datagrams=datagrams)
        self._plan, self._begin_by, self._trouble = plan, begin_by, trouble
        self._begun = 0

    @property
    def excitation(self) -> ExcitationLoop:
        """Its loop."""
        if not isinstance(self.loop, ExcitationLoop):
            raise TypeError(f"an exciter has an ExcitationLoop, not a {type(self.loop).__name__}")
        return self.loop

    def advance(self, now: float) -> None:
        """See `Companion`; leaves when the excitation is over."""
        super().advance(now)
        loop = self.excitation
        if trouble := self._trouble():
            loop.abort(Reason(trouble, at_once=False))
        if not loop.passages and now >= self._begin_by:
            loop.abort(Reason(f"not begun in time: {loop.why or 'rests'}"))
        if len(loop.passages) > self._begun:
            self._announce()
        if loop.over:
            self.close(now)
            super().advance(now)

    def next_deadline(self) -> float:
        """See `Companion`."""
        return min(super().next_deadline(), float("inf") if self.excitation.passages else self._begin_by)

    def _announce(self) -> None:
        """What begins, and, the first time, what does not limit it."""
        loop, signal = self.excitation, self._plan.signal
        unheard = loop.guard.unheard
        if not self._begun and unheard:
            self._events.append(Event(Severity.WARNING, f"not told by the vehicle, so no limit: {', '.join(unheard)}"))
        self._begun = len(loop.passages)
        passage = loop.passages[-1]
        self._events.append(
            Event.info(
                f"{passage.axis}: {signal.kind} {signal.low_hz:g} to {signal.high_hz:g} Hz for {signal.seconds:g} s, "
                f"peak {passage.amplitude:g}"
            )
        )

    def _meet(self, system: int, profile: Profile, now: float) -> None:
        super()._meet(system, watching(profile), now)

    def _take(self, fact: Fact, now: float) -> None:
        guard = self.excitation.guard
        match fact:
            case Attitude():
                self._streams.heard(Watched.ATTITUDE)
                guard.attitude(fact.angles, now)
            case Altitude():
                self._streams.heard(Watched.ALTITUDE)
                guard.altitude(fact.metres, now)
            case Battery():
                self._streams.heard(Watched.BATTERY)
                guard.battery(fact.share, now)
            case Heartbeat():
                super()._take(fact, now)
                if fact.make and fact.system == self.vehicle:
                    failsafe = fact.status in self.profile.landed.failsafe
                    self.excitation.guard.heartbeat(fact.mode, now, failsafe=failsafe)
            case _:
                super()._take(fact, now)

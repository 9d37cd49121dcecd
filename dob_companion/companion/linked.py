"""What any loop of a companion is told of its vehicle and measures of its link, whatever it answers samples with."""

import math

from dob_companion.companion.samples import Samples
from dob_companion.companion.status import Figures
from dob_companion.companion.watch import AIR
from dob_companion.mavlink import AppliedMoment, FlightState
from dob_companion.mavlink.facts import Axes3
from dob_companion.supervisor import (
    CorrectionShaper,
    Echo,
    FlightRegime,
    LinkGate,
    RoundTrip,
    State,
    Supervisor,
    Transition,
)
from dob_companion.supervisor.monitors import LATE

NOTHING: Axes3 = (0.0, 0.0, 0.0)


class LinkedLoop:
    """The part of `loop.Loop` that is the same for every loop.

    d_hat    the newest estimate, normalized torque; zero where nothing is estimated
    closing  set when the companion leaves
    """

    def __init__(self, dt: float, gate: LinkGate, samples: Samples, shaper: CorrectionShaper) -> None:
        self.dt, self.gate, self.samples, self.shaper = dt, gate, samples, shaper
        self.round_trip = RoundTrip()
        self.supervisor = Supervisor()
        self.d_hat = NOTHING
        self.closing = False
        self._now = float("-inf")
        self._transitions: list[Transition] = []

    @property
    def regime(self) -> FlightRegime:
        """Whether the aircraft flies, and who else is on the link."""
        raise NotImplementedError

    @property
    def echo(self) -> Echo:
        """The record of what we have sent."""
        raise NotImplementedError

    @property
    def state(self) -> State:
        """What the supervisor does now."""
        return self.supervisor.state

    @property
    def injecting(self) -> bool:
        """Whether the last answer may differ from zero."""
        return self.shaper.f > 0.0

    @property
    def shortfall(self) -> str:
        """What the design has not reckoned with in a link that is good enough, in words; "" for nothing."""
        return self.gate.shortfall

    @property
    def newest_us(self) -> int | None:
        """Stamp of the newest gyro sample; None before the first."""
        return self.samples.newest_us

    @property
    def clock_offset_s(self) -> float | None:
        """How far the clocks of gyro and moments lie apart; None when they are one."""
        return self.samples.clocks.offset_s

    def figures(self) -> Figures:
        """What was measured, up to the last sample."""
        counters, round_trip = self.samples.counters, self.round_trip.percentile(0.5)
        return Figures(
            rate_hz=self.gate.rate.hz,
            delay_samples=self.gate.delay_median,
            delay_p95_samples=self.gate.delay.percentile(LATE),
            round_trip_s=None if math.isnan(round_trip) else round_trip,
            d_hat=self.d_hat,
            stepped=counters.stepped,
            bridged=counters.bridged,
            gaps=counters.gaps,
            late=counters.late,
        )

    def too_old_before(self, newest_us: int) -> int:
        """A sample stamped before this is older than may be answered when `newest_us` has come."""
        return newest_us - self.gate.median_limit * round(1e6 * self.dt)

    def heartbeat(self, armed: bool, now: float, *, standing_by: bool = False) -> None:
        """The vehicle's heartbeat has come at `now` (wall, s)."""
        self.regime.heartbeat(armed, now, standing_by=standing_by)

    def flight_state(self, state: FlightState, now: float) -> None:
        """The vehicle has told where it is at `now` (wall, s)."""
        self.regime.state(AIR[state.landed], state.forward, now)

    def rc_channels(self, pulses_us: tuple[int, ...], now: float) -> None:
        """The radio's channels have come at `now` (wall, s)."""
        self.regime.rc_channels(pulses_us, now)

    def stranger(self, system: int, component: int, now: float) -> bool:
        """Another controller was heard at `now` (wall, s); whether that is news."""
        return self.regime.stranger(system, component, now)

    def strangers_gone(self, now: float) -> list[tuple[int, int]]:
        """System and component of the other controllers that are no longer heard, once each."""
        return self.regime.gone(now)

    def time_asked(self, asked_ns: int, now: float) -> None:
        """The vehicle is asked for its time, with ours in ns."""
        self.round_trip.asked(asked_ns)
        self.round_trip.forget(now)

    def time_answered(self, asked_ns: int, now: float) -> None:
        """The vehicle has answered, and repeats what it was asked with."""
        self.round_trip.answered(asked_ns, now)

    def zero_sent(self, stamp_us: int) -> None:
        """A zero was sent under this stamp although no sample had come."""
        self.echo.sent(stamp_us, NOTHING)

    def answer_left(self, stamp_us: int) -> None:
        """The answer to this sample has been handed to the link, those before it with it or not at all."""
        self.gate.takeup.left(stamp_us)

    def take_transitions(self) -> list[Transition]:
        """The changes of state since the last call."""
        taken, self._transitions = self._transitions, []
        return taken

    def _aged(self, applied: AppliedMoment) -> float:
        """The vehicle has told how old our part in a moment is, or the round trip says it: in samples."""
        age = applied.age_samples
        self.gate.takeup.reported(applied.stamp_us, age)
        samples = self.round_trip.delay_samples(self.dt) if math.isnan(age) else age
        self.gate.delay.add(applied.stamp_us, samples)
        return samples

"""What a companion carries: a loop that answers gyro samples, whatever it answers them with."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from dob_companion import __version__
from dob_companion.artifact import DobDesign
from dob_companion.companion.config import CompanionConfig
from dob_companion.companion.dob import Answer, DobLoop
from dob_companion.companion.parameters import Parameters
from dob_companion.companion.status import Figures
from dob_companion.mavlink import AppliedMoment, FlightState, GyroSample
from dob_companion.supervisor import Echo, State, Transition


class Loop(Protocol):
    """The verbs by which a companion speaks to its loop; `DobLoop` says what they mean.

    dt       sample time, s
    closing  set when the companion leaves: nothing new is begun, and what acts fades
    """

    dt: float
    closing: bool

    @property
    def state(self) -> State:
        """What it does, as DOB_STATE."""

    @property
    def why(self) -> str:
        """What speaks against injecting, in words."""

    @property
    def shortfall(self) -> str:
        """What the design has not reckoned with in a link that is good enough, in words; "" for nothing."""

    @property
    def injecting(self) -> bool:
        """Whether the last answer may differ from zero."""

    @property
    def newest_us(self) -> int | None:
        """Stamp of the newest gyro sample."""

    @property
    def clock_offset_s(self) -> float | None:
        """How far the clocks of gyro and moments lie apart; None when they are one."""

    @property
    def echo(self) -> Echo:
        """The record of what was sent."""

    def figures(self) -> Figures:
        """What was measured."""

    def too_old_before(self, newest_us: int) -> int:
        """Stamp before which a sample is not answered any more."""

    def for_another_vehicle(self) -> "Loop":
        """A loop in the place of this one for another vehicle."""

    def gyro(self, sample: GyroSample, now: float) -> Answer | None:
        """Answer a gyro sample."""

    def follow_up(self) -> None:
        """What the answer did not depend on."""

    def answer_left(self, stamp_us: int) -> None:
        """The answer has been handed to the link."""

    def moment(self, applied: AppliedMoment) -> None:
        """The applied moment of a sample."""

    def heartbeat(self, armed: bool, now: float, *, standing_by: bool = False) -> None:
        """The vehicle's heartbeat."""

    def flight_state(self, state: FlightState, now: float) -> None:
        """Where the vehicle is."""

    def rc_channels(self, pulses_us: tuple[int, ...], now: float) -> None:
        """The radio's channels."""

    def stranger(self, system: int, component: int, now: float) -> bool:
        """Another controller was heard; whether that is news."""

    def strangers_gone(self, now: float) -> list[tuple[int, int]]:
        """The others that are no longer heard."""

    def time_asked(self, asked_ns: int, now: float) -> None:
        """The vehicle is asked for its time."""

    def time_answered(self, asked_ns: int, now: float) -> None:
        """The vehicle has answered."""

    def zero_sent(self, stamp_us: int) -> None:
        """A zero was sent without a sample."""

    def take_transitions(self) -> list[Transition]:
        """The changes of state since the last call."""

    def operator_wrote(self) -> None:
        """A parameter has changed."""

    def silent(self) -> None:
        """No sample has come for longer than the vehicle holds a correction."""


@dataclass(frozen=True, slots=True)
class Task:
    """What a companion is for.

    dt        sample time of its loop, s
    limit     default of DOB_LIMIT; None for the table's
    greeting  what it says when it meets its vehicle, 50 characters at most
    loop      builds the loop on the companion's parameters
    """

    dt: float
    limit: float | None
    greeting: str
    loop: Callable[[Parameters], Loop]


def observing(design: DobDesign, config: CompanionConfig) -> Task:
    """Flying a disturbance observer."""
    return Task(
        design.dt,
        design.limit,
        f"dob-companion {__version__} design {design.sha256[:8]}",
        lambda parameters: DobLoop(design, parameters, config.regime, config.first_enabling),
    )

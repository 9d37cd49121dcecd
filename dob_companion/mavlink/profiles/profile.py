"""What is to be known of a kind of vehicle, as one frozen object."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from dob_companion.mavlink.facts import Fact, FlightState, Input, Landed, Watched

Fields = tuple[Any, ...]
"""The fields of a message in the order of the wire, arrays laid out flat."""


class AgeSource(Enum):
    """Where the age of the correction in an applied moment comes from."""

    REPORTED = "reported by the vehicle"
    ESTIMATED = "estimated from the round trip of TIMESYNC"


@dataclass(frozen=True, slots=True, kw_only=True)
class Stream:
    """A message wanted of the vehicle: MAVLink name and number, what it brings, and the interval in µs; None stands for
    the sample time of the design. RC channels are wanted only where one of them is a kill switch. `unasked`: it comes
    without being asked for, at a rate of its own, and the autopilot, which does not know of it, would refuse."""

    name: str
    message: int
    brings: Input | Watched
    interval_us: int | None = None
    unasked: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Reader:
    """How a message becomes a fact. `layout` is pymavlink's class of the message, `fact` takes its fields in the order
    of the wire and gives None where the message is not about us. It never raises, whatever the values are."""

    layout: Any
    fact: Callable[[Fields], Fact | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class LandedRule:
    """How the vehicle says whether it flies, in numbers of MAVLink.

    standing_by   HEARTBEAT.system_status that it never says in flight; another one proves nothing
    states        EXTENDED_SYS_STATE.landed_state to what it means; any other is unknown
    hover         EXTENDED_SYS_STATE.vtol_state in which a multicopter's model holds
    failsafe      HEARTBEAT.system_status by which it says that it is in trouble
    """

    standing_by: frozenset[int]
    states: Mapping[int, Landed]
    hover: frozenset[int]
    failsafe: frozenset[int] = frozenset()

    def read(self, fields: Fields) -> FlightState:
        """EXTENDED_SYS_STATE."""
        vtol_state, landed_state = fields
        return FlightState(self.states.get(landed_state, Landed.UNKNOWN), vtol_state not in self.hover)


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Where the inputs of an observer come from on one kind of vehicle, and how its correction gets there.

    name          as `--profile` takes it
    makes         of autopilots that it is recognized by, and the only ones that it is for; () is for any
    streams       messages asked for and watched
    readers       message number to reader; also what is read without pymavlink's objects (`frame`)
    carrier       MAVLink name of the message that carries a correction, unless the configuration names another
    age           where the age of that correction comes from. A reader of an estimated one gives it as NaN
    landed        how the vehicle says whether it flies
    rate_hz       rate of the samples; a design for another one is refused
    remedy        what it takes on the vehicle's side, for who has not got it
    speed_remedy  what raises the rate of a stream on this kind of vehicle; "" where nothing is known
    also_heard    names of messages that `doctor` asks for besides, to show what the vehicle can send
    """

    name: str
    makes: tuple[str, ...]
    streams: tuple[Stream, ...]
    readers: Mapping[int, Reader]
    carrier: str
    age: AgeSource
    landed: LandedRule
    rate_hz: float
    remedy: str
    speed_remedy: str = ""
    also_heard: tuple[str, ...] = ()
    layouts: dict[int, Any] = field(init=False, repr=False, compare=False)
    """Message number to pymavlink's class, of all readers."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "layouts", {number: reader.layout for number, reader in self.readers.items()})

    def suits(self, make: str) -> bool:
        """Whether it is for an autopilot of this make."""
        return not self.makes or make in self.makes

    def stream(self, what: Input | Watched) -> Stream:
        """The stream that brings this. Raises KeyError where none does."""
        for stream in self.streams:
            if stream.brings is what:
                return stream
        raise KeyError(what)

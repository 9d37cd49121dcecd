"""What happens to a vehicle at a given time of a window: each kind of [[event]] of a scenario file. Pure."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field
from math import inf
from typing import Protocol

from sitl.airframe.condition import Condition
from sitl.attitude import LEVEL, ZERO, Quaternion, Vector, rotated_by_rate
from sitl.autopilot.vehicle import Vehicle
from sitl.channel import Channel, Quality
from sitl.constants import AXES
from sitl.scenario.tables import Table


@dataclass(slots=True)
class Stage:
    """All that events can change. `begin` puts it back as it was when the flight began."""

    vehicle: Vehicle
    channel: Channel
    hover_altitude: float
    wall_m: float = inf
    _before: Condition = field(init=False)
    _position_hold: bool = field(init=False)
    _feed_forward: bool = field(init=False)

    def __post_init__(self) -> None:
        self._before, self._position_hold = copy(self.condition), self.vehicle.position_hold
        self._feed_forward = self.vehicle.hold.feed_forward

    @property
    def condition(self) -> Condition:
        """What has become of the aircraft."""
        return self.vehicle.airframe.condition

    def begin(self) -> None:
        """Undo every event."""
        for name in Condition.__slots__:
            setattr(self.condition, name, getattr(self._before, name))
        self.wall_m = inf
        self.vehicle.gyro.bias, self.vehicle.attitude_command = ZERO, LEVEL
        self.vehicle.position_hold, self.vehicle.hold.feed_forward = self._position_hold, self._feed_forward
        if self.vehicle.target_altitude is not None:
            self.vehicle.target_altitude = self.hover_altitude


class Change(Protocol):
    """One kind of event."""

    def apply(self, stage: Stage) -> None:
        """Let it happen."""
        ...


@dataclass(frozen=True, slots=True)
class Event:
    """A change at `at_s` of window time; before 0 it is in the lead. `label` is for figures, "" for no mark."""

    at_s: float
    label: str
    change: Change


@dataclass(frozen=True, slots=True)
class Becomes:
    """Attributes of `Condition` take new values."""

    values: tuple[tuple[str, object], ...]

    def apply(self, stage: Stage) -> None:
        """Set them."""
        for name, value in self.values:
            setattr(stage.condition, name, value)


@dataclass(frozen=True, slots=True)
class RotorFails:
    """One rotor keeps only this share of its thrust and torque; rotors are counted from 1."""

    rotor: int
    effectiveness: float

    def apply(self, stage: Stage) -> None:
        """Weaken it."""
        share = list(stage.condition.rotor_effectiveness)
        share[self.rotor - 1] = self.effectiveness
        stage.condition.rotor_effectiveness = (share[0], share[1], share[2], share[3])


@dataclass(frozen=True, slots=True)
class GyroBias:
    """The gyro's bias jumps to these rates, rad/s."""

    bias: Vector

    def apply(self, stage: Stage) -> None:
        """Jump."""
        stage.vehicle.gyro.bias = self.bias


@dataclass(frozen=True, slots=True)
class Wall:
    """A vertical wall stands this far to the north, m."""

    distance_m: float

    def apply(self, stage: Stage) -> None:
        """Put it there."""
        stage.wall_m = self.distance_m


@dataclass(frozen=True, slots=True)
class Altitude:
    """The pilot asks for another height, m."""

    altitude_m: float

    def apply(self, stage: Stage) -> None:
        """Ask."""
        stage.vehicle.target_altitude = self.altitude_m


@dataclass(frozen=True, slots=True)
class Attitude:
    """The pilot commands an attitude."""

    command: Quaternion

    def apply(self, stage: Stage) -> None:
        """Command it."""
        stage.vehicle.attitude_command = self.command


@dataclass(frozen=True, slots=True)
class AttitudeOnly:
    """Nobody holds the position any more: the attitude held is the pilot's, and the vehicle drifts."""

    def apply(self, stage: Stage) -> None:
        """Let go."""
        stage.vehicle.position_hold = False


@dataclass(frozen=True, slots=True)
class FeedForward:
    """Position hold leans smoothly and feeds the rate of its lean forward."""

    def apply(self, stage: Stage) -> None:
        """Switch it on."""
        stage.vehicle.hold.feed_forward = True


@dataclass(frozen=True, slots=True)
class Link:
    """The link behaves like this from now on."""

    quality: Quality

    def apply(self, stage: Stage) -> None:
        """Let it."""
        stage.channel.quality = self.quality


class Timeline:
    """Lets the events of one segment happen, each at its sample; `begin` starts it anew."""

    def __init__(self, events: tuple[Event, ...], stage: Stage, lead_s: float, rate_hz: float) -> None:
        ordered = sorted(events, key=lambda event: event.at_s)
        self._plan = [(round((event.at_s + lead_s) * rate_hz), event.change) for event in ordered]
        self._stage = stage
        self._next, self._k = len(self._plan), 0

    def begin(self, eventful: bool) -> None:
        """From the segment's first sample on; without events when it is to be quiet."""
        self._stage.begin()
        self._next, self._k = 0 if eventful else len(self._plan), 0

    def sample(self) -> None:
        """Let happen what is due before the next sample."""
        while self._next < len(self._plan) and self._plan[self._next][0] <= self._k:
            self._plan[self._next][1].apply(self._stage)
            self._next += 1
        self._k += 1


def read_events(tables: list[Table], lead_s: float, length_s: float) -> tuple[Event, ...]:
    """The [[event]] tables of a scenario file. Without `at_s` an event is there from the lead's beginning.

    Raises ScenarioError.
    """
    events: list[Event] = []
    for table in tables:
        kind = table.choice("kind", tuple(KINDS))
        at_s = table.number("at_s", -lead_s, length_s, -lead_s)
        events += KINDS[kind](table, at_s)
        table.finish()
    return tuple(events)


def _payload(table: Table, at_s: float) -> list[Event]:
    kg = table.number("kg", 0.0, 100.0)
    return [Event(at_s, f"payload {kg:g} kg", Becomes((("payload_kg", kg),)))]


def _rotor(table: Table, at_s: float) -> list[Event]:
    fails = RotorFails(table.whole("rotor", 1, 4), table.number("effectiveness", 0.0, 1.0))
    return [Event(at_s, f"rotor {fails.rotor} at {fails.effectiveness:.0%}", fails)]


def _battery(table: Table, at_s: float) -> list[Event]:
    charge = table.number("charge", 0.0, 1.0)
    return [Event(at_s, f"battery {charge:.0%}", Becomes((("battery_charge", charge), ("battery_sag", True))))]


def _flexible(_: Table, at_s: float) -> list[Event]:
    return [Event(at_s, "flexible", Becomes((("flexible", True),)))]


def _gain(table: Table, at_s: float) -> list[Event]:
    factor = table.number("factor", 0.01, 10.0)
    return [Event(at_s, f"plant gain × {factor:g}", Becomes((("gain", (factor, factor, factor)),)))]


def _gyro_bias(table: Table, at_s: float) -> list[Event]:
    return [Event(at_s, "gyro bias", GyroBias(table.vector("rad_s", AXES, -1.0, 1.0)))]


def _wall(table: Table, at_s: float) -> list[Event]:
    wall = Wall(table.number("distance_m", 0.1, 1e6))
    return [Event(at_s, f"wall at {wall.distance_m:g} m", wall)]


def _altitude(table: Table, at_s: float) -> list[Event]:
    altitude = Altitude(table.number("altitude_m", 0.2, 100.0))
    return [Event(at_s, f"to {altitude.altitude_m:g} m", altitude)]


def _hold(table: Table, at_s: float) -> list[Event]:
    axis = table.choice("axis", AXES)
    return [Event(at_s, f"held: {axis} only", Becomes((("held_axis", AXES.index(axis)),)))]


def _doublet(table: Table, at_s: float) -> list[Event]:
    """Steps of + amplitude and − amplitude, half a period each, then level."""
    axis = AXES.index(table.choice("axis", AXES))
    amplitude = table.number("amplitude_rad", 0.0, 1.0)
    period = table.number("period_s", 0.1, 60.0)
    cycles = table.whole("cycles", 1, 1000, 1)
    sides = [Attitude(_turned(axis, sign * amplitude)) for sign in (1.0, -1.0)]
    steps = [Event(at_s + 0.5 * period * i, "" if i else "doublet", sides[i % 2]) for i in range(2 * cycles)]
    return [*steps, Event(at_s + period * cycles, "", Attitude(LEVEL))]


def _turned(axis: int, angle: float) -> Quaternion:
    x, y, z = (angle if i == axis else 0.0 for i in range(3))
    return rotated_by_rate(LEVEL, (x, y, z), 1.0)


def _attitude_only(_: Table, at_s: float) -> list[Event]:
    return [Event(at_s, "attitude only", AttitudeOnly())]


def _feed_forward(_: Table, at_s: float) -> list[Event]:
    return [Event(at_s, "feed-forward", FeedForward())]


def _link(table: Table, at_s: float) -> list[Event]:
    quality = Quality(
        pairs_lost=table.number("pairs_lost", 0.0, 1.0, 0.0),
        answers_lost=table.number("answers_lost", 0.0, 1.0, 0.0),
        delay_samples=table.whole("delay_samples", 0, 20, 0),
        jitter_samples=table.whole("jitter_samples", 0, 20, 0),
    )
    return [Event(at_s, "link", Link(quality))]


KINDS: dict[str, Callable[[Table, float], list[Event]]] = {
    "payload": _payload,
    "rotor": _rotor,
    "battery": _battery,
    "flexible": _flexible,
    "gain": _gain,
    "gyro_bias": _gyro_bias,
    "wall": _wall,
    "altitude": _altitude,
    "hold": _hold,
    "doublet": _doublet,
    "attitude_only": _attitude_only,
    "feed_forward": _feed_forward,
    "link": _link,
}
"""Readers of the kinds of event, by name."""

"""Whether the aircraft is where the plant model holds: armed, in the air, in multicopter mode, alone, not killed.

Nothing of this is known for ever: each fact has an age beyond which it counts no more (`ages`).
"""

from dataclasses import dataclass
from enum import Enum

from dob_companion.supervisor import ages
from dob_companion.supervisor.ages import Told


class Air(Enum):
    """Whether the aircraft flies, as it says itself."""

    UNKNOWN = "unknown"
    ON_GROUND = "on the ground"
    IN_AIR = "in the air"
    CHANGING = "taking off or landing"


MOST_STRANGERS = 8
"""Others on the link that are kept by name; more of them are no more trouble."""


@dataclass(frozen=True, slots=True)
class RegimeLimits:
    """throttle_floor: least thrust, 0…1, at which a moment means anything.

    kill_channel and kill_above: an RC channel (1…18) whose pulse above so many µs forbids injecting; channel 0: none.
    """

    throttle_floor: float = 0.05
    kill_channel: int = 0
    kill_above: int = 1700


class FlightRegime:
    """Collects what the vehicle says of itself and judges it. Each setter takes one message's worth of facts.

    `now` is wall time in s; `vehicle_time` is told how far the vehicle's own clock is (`Told` says why ages need both).

    A vehicle that has never told whether it is in the air, or its VTOL state, is judged by its heartbeat (armed, and
    not standing by) and its throttle: a multicopter autopilot need not have these messages. One that has told it must
    go on: what it said last may be over. A kill switch that is configured must be heard from the beginning.
    """

    __slots__ = (
        "_air",
        "_armed",
        "_flight",
        "_forward",
        "_heartbeat",
        "_kill",
        "_killed",
        "_limits",
        "_standing_by",
        "_strangers",
        "_throttle",
        "_vehicle_s",
    )

    def __init__(self, limits: RegimeLimits) -> None:
        self._limits = limits
        self._armed = self._killed = self._forward = self._standing_by = False
        self._air: Air | None = None
        self._throttle = 0.0
        self._vehicle_s = 0.0
        self._heartbeat, self._flight, self._kill = Told(), Told(), Told()
        self._strangers: dict[tuple[int, int], float] = {}

    def vehicle_time(self, seconds: float) -> None:
        """The vehicle's clock, by the stamp of its newest sample."""
        self._vehicle_s = seconds

    def forget(self) -> None:
        """The vehicle's clock has restarted: what it said before holds no more."""
        for told in (self._heartbeat, self._flight, self._kill):
            told.forget()

    def heartbeat(self, armed: bool, now: float, *, standing_by: bool = False) -> None:
        """The autopilot's heartbeat. `standing_by` means on the ground, while nothing better is known."""
        self._armed, self._standing_by = armed, standing_by
        self._heartbeat.at(now, self._vehicle_s)

    def state(self, air: Air, forward: bool, now: float) -> None:
        """In the air or not; `forward` in transition to, or in, fixed-wing flight."""
        self._air, self._forward = air, forward
        self._flight.at(now, self._vehicle_s)

    @property
    def down(self) -> bool:
        """No flight, by what was told last: not armed, or on the ground."""
        return not self._armed or self._air is Air.ON_GROUND

    def throttle(self, thrust: float) -> None:
        """Thrust setpoint, 0…1."""
        self._throttle = thrust

    def rc_channels(self, pulses_us: tuple[int, ...], now: float) -> None:
        """RC channels 1, 2, …; a pulse of 0 or 65535 µs means that the channel is not there, which says nothing."""
        channel = self._limits.kill_channel
        if 0 < channel <= len(pulses_us) and pulses_us[channel - 1] not in (0, 65535):
            self._killed = pulses_us[channel - 1] > self._limits.kill_above
            self._kill.at(now, self._vehicle_s)

    def stranger(self, system: int, component: int, now: float) -> bool:
        """Another autopilot, or another companion that injects, was heard on this link. Returns whether it is new."""
        who = system, component
        new = who not in self._strangers
        if not new or len(self._strangers) < MOST_STRANGERS:
            self._strangers[who] = now
        return new and who in self._strangers

    def gone(self, now: float) -> list[tuple[int, int]]:
        """The others that have not been heard for long; they are forgotten."""
        gone = [who for who, heard in self._strangers.items() if now - heard > ages.STRANGER_S]
        for who in gone:
            del self._strangers[who]
        return gone

    def why_not(self, now: float) -> str:
        """What speaks against injecting; "" when nothing does."""
        limits, why = self._limits, ""
        if self._killed:
            why = f"killed by RC channel {limits.kill_channel}"
        elif limits.kill_channel and self._kill.age(now, self._vehicle_s) > ages.KILL_SWITCH_S:
            why = f"kill switch not heard, RC channel {limits.kill_channel}"
        elif self._strangers and (here := self._here(now)):
            why = f"another controller on the link: {here}"
        elif self._heartbeat.age(now, self._vehicle_s) > ages.HEARTBEAT_S:
            why = "no heartbeat of the autopilot"
        elif not self._armed:
            why = "not armed"
        elif self._air is not None and self._flight.age(now, self._vehicle_s) > ages.FLIGHT_STATE_S:
            why = "flight state no longer told"
        elif self._air is Air.ON_GROUND or self._air is Air.CHANGING:
            why = str(self._air.value)
        elif self._standing_by and self._air is not Air.IN_AIR:
            why = "standing by, its heartbeat says"
        elif self._forward:
            why = "not in multicopter mode"
        elif not self._throttle >= limits.throttle_floor:  # nor when it is not a number
            why = f"throttle below {limits.throttle_floor:g}"
        return why

    def _here(self, now: float) -> str:
        here = sorted(who for who, heard in self._strangers.items() if now - heard <= ages.STRANGER_S)
        return ", ".join(f"{system}/{component}" for system, component in here)

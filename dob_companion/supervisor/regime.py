"""Whether the aircraft is where the plant model holds: armed, in the air, in multicopter mode, alone, not killed."""

from dataclasses import dataclass
from enum import Enum

HEARTBEAT_PATIENCE_S = 5.0
"""Wall time without the autopilot's heartbeat (1 Hz) after which nothing is known of its mode."""


class Air(Enum):
    """Whether the aircraft flies, as it says itself."""

    UNKNOWN = "unknown"
    ON_GROUND = "on the ground"
    IN_AIR = "in the air"
    CHANGING = "taking off or landing"


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

    A vehicle that never tells whether it is in the air, or its VTOL state, is judged by its heartbeat (armed, and not
    standing by) and its throttle: a multicopter autopilot need not have these messages.
    """

    __slots__ = (
        "_air",
        "_armed",
        "_forward",
        "_heard",
        "_killed",
        "_limits",
        "_standing_by",
        "_strangers",
        "_throttle",
    )

    def __init__(self, limits: RegimeLimits) -> None:
        self._limits = limits
        self._armed = self._killed = self._forward = self._standing_by = False
        self._air = Air.UNKNOWN
        self._throttle = 0.0
        self._heard = float("-inf")
        self._strangers: set[tuple[int, int]] = set()

    def heartbeat(self, armed: bool, now: float) -> None:
        """The autopilot's heartbeat, at wall time `now`."""
        self._armed, self._heard = armed, now

    def state(self, air: Air, forward: bool) -> None:
        """In the air or not; `forward` in transition to, or in, fixed-wing flight."""
        self._air, self._forward = air, forward

    def heartbeat_says(self, *, on_ground: bool) -> None:
        """What the autopilot's heartbeat tells of it; counts while nothing better is known."""
        self._standing_by = on_ground

    def throttle(self, thrust: float) -> None:
        """Thrust setpoint, 0…1."""
        self._throttle = thrust

    def rc_channels(self, pulses_us: tuple[int, ...]) -> None:
        """RC channels 1, 2, …; a pulse of 0 or 65535 µs means that the channel is not there, which changes nothing."""
        channel = self._limits.kill_channel
        if 0 < channel <= len(pulses_us) and pulses_us[channel - 1] not in (0, 65535):
            self._killed = pulses_us[channel - 1] > self._limits.kill_above

    def stranger(self, system: int, component: int) -> None:
        """Another autopilot, or another companion that injects, was heard on this link."""
        self._strangers.add((system, component))

    def why_not(self, now: float) -> str:
        """What speaks against injecting; "" when nothing does. `now` in wall time, s."""
        why = ""
        if self._killed:
            why = f"killed by RC channel {self._limits.kill_channel}"
        elif self._strangers:
            why = f"another controller on the link: {_names(self._strangers)}"
        elif now - self._heard > HEARTBEAT_PATIENCE_S:
            why = "no heartbeat of the autopilot"
        elif not self._armed:
            why = "not armed"
        elif self._air is Air.ON_GROUND or self._air is Air.CHANGING:
            why = str(self._air.value)
        elif self._standing_by and self._air is Air.UNKNOWN:
            why = "standing by, its heartbeat says"
        elif self._forward:
            why = "not in multicopter mode"
        elif not self._throttle >= self._limits.throttle_floor:  # nor when it is not a number
            why = f"throttle below {self._limits.throttle_floor:g}"
        return why


def _names(strangers: set[tuple[int, int]]) -> str:
    return ", ".join(f"{system}/{component}" for system, component in sorted(strangers))

"""What the companion shows of itself: a picture of the moment, and what has happened."""

from dataclasses import dataclass, replace

from dob_companion.mavlink import Severity
from dob_companion.mavlink.facts import Axes3
from dob_companion.supervisor import State, Transition
from dob_companion.supervisor.monitors import UNKNOWN_AGE


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth a line in the log; `change` where it is a change of the supervisor's state."""

    severity: Severity
    text: str
    change: Transition | None = None

    @classmethod
    def info(cls, text: str) -> "Event":
        """An event that asks nothing of anybody."""
        return cls(Severity.INFO, text)


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """What the loop has measured; fields as in Status."""

    rate_hz: float
    delay_samples: int
    delay_p95_samples: int
    round_trip_s: float | None
    d_hat: Axes3
    stepped: int
    bridged: int
    gaps: int
    late: int

    def without_samples(self) -> "Figures":
        """What of it is still true when samples have stopped."""
        nothing = (0.0, 0.0, 0.0)
        return replace(self, rate_hz=0.0, delay_samples=UNKNOWN_AGE, delay_p95_samples=UNKNOWN_AGE, d_hat=nothing)


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """A picture of the moment. `why` says what speaks against injecting, "" when nothing does.

    Moments in normalized torque, hover axes: the estimate, and the correction that was sent last; rate in Hz;
    delay, its median and 95th percentile, in samples, 255 where it is not known; round trip of TIMESYNC in s, None
    while none was measured; `heard_s` since the vehicle was last heard, None before it ever was. Without samples
    for half a second rate and estimate are zero and the delay is not known: what was true of a vehicle that has
    gone is true no more.
    """

    state: State
    why: str
    rate_hz: float
    delay_samples: int
    delay_p95_samples: int
    round_trip_s: float | None
    d_hat: Axes3
    correction: Axes3
    stepped: int
    bridged: int
    gaps: int
    late: int
    bad: int
    foreign: int
    heard_s: float | None

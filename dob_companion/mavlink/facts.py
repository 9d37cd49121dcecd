"""What the companion takes from the wire, without a trace of MAVLink. Stamps µs of the vehicle's clock."""

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

Axes3 = tuple[float, float, float]
"""Roll, pitch, yaw in hover axes."""


class Input(Enum):
    """What the companion needs of the vehicle, whichever message brings it."""

    GYRO = "gyro"
    MOMENT = "applied moment"
    FLIGHT_STATE = "flight state"
    RC_CHANNELS = "RC channels"


class Watched(Enum):
    """What a limit needs of the vehicle besides, where it tells it."""

    ATTITUDE = "attitude"
    ALTITUDE = "altitude"
    BATTERY = "battery"


class Landed(Enum):
    """Whether the vehicle flies, as it says itself."""

    UNKNOWN = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKING_OFF = 3
    LANDING = 4


@dataclass(frozen=True, slots=True)
class Sender:
    """Whom an answer goes to."""

    system: int
    component: int


class GyroSample(NamedTuple):
    """y_n(k): body rates in rad/s, measured at `stamp_us`. May be non-finite: the reader must look."""

    stamp_us: int
    rates: Axes3


@dataclass(frozen=True, slots=True)
class AppliedMoment:
    """u_e(k): normalized torque acting from `stamp_us` on, correction and saturation included.

    `correction` is the part of it that came from us, `age_samples` how old that part is (negative: none), `thrust`
    the thrust setpoint, 0…1. With `read_late_us` it was read by a program beside the controller, less often than that
    makes a new one: the controller's part is a sample of what acts around the stamp, ours acts from so much later on.
    """

    stamp_us: int
    moment: Axes3
    thrust: float
    correction: Axes3
    age_samples: float
    read_late_us: int | None = None


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Somebody is alive. `make` is that of a flight controller (`makes`), "" for anybody else; `status` the number of
    its state, which a profile's rule understands; `simulated` that its actuators are blocked and its clock is that of a
    simulation (hardware in the loop); `mode` the number of its flight mode, which differs from make to make."""

    system: int
    component: int
    make: str
    armed: bool
    status: int
    simulated: bool = False
    mode: int = 0


@dataclass(frozen=True, slots=True)
class FlightState:
    """Whether the vehicle is in the air, and whether a VTOL is in forward flight or in transition."""

    landed: Landed
    forward: bool


@dataclass(frozen=True, slots=True)
class RcChannels:
    """Pulses of RC channels 1, 2, … in µs; 0 or 65535 where there is none."""

    pulses_us: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Attitude:
    """Roll, pitch and yaw angles (z-y-x), rad; may be non-finite."""

    angles: Axes3


@dataclass(frozen=True, slots=True)
class Altitude:
    """Above the place of take-off, m."""

    metres: float


@dataclass(frozen=True, slots=True)
class Battery:
    """What is left of its charge, 0…1; NaN where the vehicle does not know."""

    share: float


@dataclass(frozen=True, slots=True)
class CorrectionHeard:
    """A correction that came *in*: our own echoed back, or somebody else's."""

    sender: Sender
    stamp_us: int
    correction: Axes3


@dataclass(frozen=True, slots=True)
class ParamRead:
    """A request for one parameter (by name, or by index when the name is empty) or, with neither, for all.

    `addressed` is True when it names our component and not merely everybody.
    """

    name: str
    index: int | None
    addressed: bool
    sender: Sender


@dataclass(frozen=True, slots=True)
class ParamWrite:
    """A parameter write. `value` is what a REAL32 reading gives; `bytewise` is the same four bytes as an integer of
    the sender's type, or None when the sender wrote a real number."""

    name: str
    value: float
    bytewise: int | None
    addressed: bool
    sender: Sender


@dataclass(frozen=True, slots=True)
class CommandAck:
    """The vehicle's answer to a command of ours; `accepted` is False for any refusal."""

    command: int
    accepted: bool
    result: int


@dataclass(frozen=True, slots=True)
class CommandForUs:
    """A command that names our component."""

    command: int
    sender: Sender


@dataclass(frozen=True, slots=True)
class FileRequest:
    """Somebody asks our component for a file by MAVLink FTP; `payload` is the protocol's own header and data."""

    payload: bytes
    sender: Sender


@dataclass(frozen=True, slots=True)
class TimesyncRequest:
    """The vehicle asks for our clock; `ts1_ns` goes back unchanged."""

    ts1_ns: int


@dataclass(frozen=True, slots=True)
class TimesyncReply:
    """The vehicle's answer to our TIMESYNC: `ts1_ns` is our own clock when we asked."""

    ts1_ns: int


Fact = (
    GyroSample
    | AppliedMoment
    | Heartbeat
    | FlightState
    | RcChannels
    | Attitude
    | Altitude
    | Battery
    | CorrectionHeard
    | ParamRead
    | ParamWrite
    | CommandAck
    | CommandForUs
    | FileRequest
    | TimesyncRequest
    | TimesyncReply
)

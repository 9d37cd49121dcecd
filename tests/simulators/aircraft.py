"""The two real autopilots in their own simulators behind one face, with a relay on the companion's link."""

import contextlib
import json
import os
import struct
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from dob_companion.mavlink.tunnel import PAYLOAD, PAYLOAD_TYPE
from tests.ardupilot import tailsitter
from tests.ardupilot.flights import ACTIVE
from tests.ardupilot.programs import UPDATE_S
from tests.ardupilot.simulator import Ground, companion, copter
from tests.px4.simulator import Px4Ground, sih
from tests.simulators.relay import COMPANION_PORT, VEHICLE_PORT, Fate, Passed, Relay, Way, passed, relay

LINK = f"udpin:127.0.0.1:{COMPANION_PORT}"
AUTOPILOT, COMPANION = 1, 191
HIGHRES_IMU, TUNNEL, DEBUG_VECT = 105, 385, 250


def component(frame: bytes) -> int:
    """Component of the sender of a MAVLink 2 message."""
    return frame[6]


def number(frame: bytes) -> int:
    """Id of a MAVLink 2 message."""
    return int.from_bytes(frame[7:10], "little")


def payload(frame: bytes, size: int) -> bytes:
    """Payload of a MAVLink 2 message, with the zeros that it leaves out."""
    return frame[10 : 10 + frame[1]].ljust(size, b"\0")


@dataclass(frozen=True)
class Aircraft:
    """A simulated vehicle: how it is started, flown, and how it reports what acts."""

    name: str
    variable: str
    start: Callable[..., contextlib.AbstractContextManager]
    ground: type[Ground]
    report: int
    layout: struct.Struct
    correction_at: int
    named: bytes = b""
    script: bool = False
    """Whether the moment is read beside the rate controller, now and then."""
    options: tuple[str, ...] = ()
    """Of the daemon, for this vehicle."""

    def program(self) -> Path | None:
        """Where the simulator is, if it is known."""
        return Path(os.environ[self.variable]) if self.variable in os.environ else None

    def applied(self, frame: bytes) -> tuple[float, ...] | None:
        """Stamp in s, moment and correction in it, of a report of what acts; None of other messages."""
        if component(frame) != AUTOPILOT or number(frame) != self.report:
            return None
        whole = payload(frame, 300)
        if self.named and not whole[10:].startswith(self.named):
            return None
        stamp, *values = self.layout.unpack_from(whole)
        at = self.correction_at
        return (stamp * 1e-6, *values[:3], *values[at : at + 3])


def _to_relay(start: Callable[..., contextlib.AbstractContextManager]) -> Callable:
    return partial(start, companion_port=f"udpclient:127.0.0.1:{VEHICLE_PORT}")


AIRCRAFT = {
    "ardupilot": Aircraft(
        "ardupilot", "DOB_ARDUCOPTER", _to_relay(copter), Ground, 140, struct.Struct("<Q8f"), 4, script=True
    ),
    "px4": Aircraft("px4", "DOB_PX4", sih, Px4Ground, 350, struct.Struct("<Q12x58f"), 4, b"DOB_ACT\0"),
}
TAILSITTER = replace(
    AIRCRAFT["ardupilot"],
    name="arduplane",
    variable="DOB_ARDUPLANE",
    start=_to_relay(tailsitter.tailsitter),
    ground=tailsitter.PlaneGround,
    options=tailsitter.OPTIONS,
)


def correction(frame: bytes) -> tuple[int, tuple[float, float, float]] | None:
    """Stamp in µs and correction of a message in which a companion asks for one; None of other messages."""
    if component(frame) != COMPANION:
        return None
    if number(frame) == DEBUG_VECT and payload(frame, 30)[20:] == b"DOB_CORR\0\0":
        stamp, x, y, z = struct.unpack_from("<Qfff", payload(frame, 30))
        return stamp, (x, y, z)
    if number(frame) == TUNNEL and struct.unpack_from("<H", payload(frame, 133))[0] == PAYLOAD_TYPE:
        stamp, x, y, z = PAYLOAD.unpack_from(payload(frame, 133), 5)
        return stamp, (x, y, z)
    return None


@dataclass
class Flight:
    """An aircraft with its companion's link through a relay, and a ground station that turns it. Use it in `hover`."""

    aircraft: Aircraft
    design: Path
    directory: Path
    relay: Relay
    parameters: dict[str, float]
    marks: dict[str, float] = field(default_factory=dict)
    texts: list[tuple[float, int, str]] = field(default_factory=list)
    _power: contextlib.ExitStack = field(default_factory=contextlib.ExitStack)
    _signals: dict[int, np.ndarray] = field(default_factory=dict)
    _turns: int = 0

    def switch_on(self) -> None:
        """Start the simulator, and a ground station beside it."""
        program = self.aircraft.program()
        if program is None:
            raise SystemExit(f"no {self.aircraft.name}: {self.aircraft.variable} is to be the path of its simulator")
        self.simulator = self._power.enter_context(self.aircraft.start(program, self.directory, **self.parameters))
        self._turns += 1
        self.ground = self.aircraft.ground(self.directory / f"ground{self._turns}.tlog")
        self.ground.texts = self.texts
        self._power.callback(self.ground.close)
        over = threading.Event()
        thread = threading.Thread(target=self._turn, args=(self.ground, over), daemon=True)
        thread.start()
        self._power.callback(thread.join, 5)
        self._power.callback(over.set)

    def switch_off(self) -> None:
        """End the simulator, as if its battery had been pulled."""
        self._power.close()

    def companion(self, *more: object) -> contextlib.AbstractContextManager:
        """The daemon, at the relay."""
        return companion(self.design, self.directory, *self.aircraft.options, *more, link=LINK)

    def take_off(self) -> None:
        """Until it hovers."""
        self.ground.fly()

    def disturb(self, signals: dict[int, np.ndarray]) -> None:
        """From now on these angular accelerations, rad/s², about these axes, one for each UPDATE_S, over and over."""
        self._signals = signals

    def _turn(self, ground: Ground, over: threading.Event) -> None:
        begin = time.monotonic()
        while not over.is_set():
            due = int((time.monotonic() - begin) / UPDATE_S)
            if self._signals:
                ground.disturb({axis: float(values[due % len(values)]) for axis, values in self._signals.items()})
            time.sleep(max(0.0, begin + (due + 1) * UPDATE_S - time.monotonic()))

    def mark(self, name: str, at: float | None = None) -> None:
        """Something happens now, or at a monotonic time."""
        self.marks[name] = time.monotonic() if at is None else at

    def wait_active(self, seconds: float = 60.0) -> None:
        """Until the correction is fully in."""
        told = self.ground.telemetry
        told.clear()
        self.ground.wait("ACTIVE", lambda: bool(told) and told[-1][7] == ACTIVE, seconds)

    def enable(self) -> None:
        """Switch on, and wait until the correction is fully in."""
        self.ground.set("DOB_ENABLE", 1.0, component=COMPANION)
        self.wait_active()


@contextlib.contextmanager
def hover(aircraft: Aircraft, design: Path, directory: Path, **parameters: float) -> Iterator[Flight]:
    """A started simulator with relay and ground station, on the ground until `take_off`."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "companion.jsonl").unlink(missing_ok=True)
    with relay(directory / "wire.log") as wire:
        flight = Flight(aircraft, design, directory, wire, parameters)
        try:
            flight.switch_on()
            yield flight
        finally:
            flight.switch_off()
            (directory / "marks.json").write_text(json.dumps(flight.marks, indent=1))
            (directory / "texts.json").write_text(json.dumps(flight.texts, indent=1))


@dataclass(frozen=True)
class Wire:
    """What a relay has kept of a flight: `acts` rows of monotonic time, stamp s, moment, correction, as the autopilot
    reported them, delivered or not; `asked` rows of monotonic time, stamp s, correction, as the companion sent them."""

    acts: np.ndarray
    asked: np.ndarray
    arrived: np.ndarray

    @classmethod
    def of(cls, aircraft: Aircraft, log: Path) -> "Wire":
        """Read it back."""
        acts, asked, arrived = [], [], []
        for p in passed(log):
            if p.way is Way.DOWN and (row := aircraft.applied(p.frame)):
                acts.append((p.came, *row))
            elif p.way is Way.UP and (found := correction(p.frame)):
                asked.append((p.came, found[0] * 1e-6, *found[1]))
                arrived.append(whole(p))
        return cls(np.array(acts), np.array(asked), np.array(arrived))

    def acting(self, begin: float, end: float) -> np.ndarray:
        """The reports of a span of monotonic time."""
        return self.acts[(self.acts[:, 0] >= begin) & (self.acts[:, 0] < end)]


def whole(p: Passed) -> bool:
    """Whether a message arrived as it was sent."""
    return p.fate in (Fate.WHOLE, Fate.TWICE)

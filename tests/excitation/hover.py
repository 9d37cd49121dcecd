"""A hovering vehicle's facts for the pure loop of an excitation, in simulated time."""

import copy
import functools
import math
from dataclasses import dataclass, field

from dob_companion.companion.parameters import Parameters
from dob_companion.excitation.limits import Limits
from dob_companion.excitation.loop import ExcitationLoop
from dob_companion.excitation.plan import Plan
from dob_companion.excitation.signal import Excitation
from dob_companion.mavlink import AppliedMoment, FlightState, GyroSample, Landed, ParamWrite, Sender
from dob_companion.supervisor import RegimeLimits, State

DT, DT_US, T0 = 0.004, 4000, 10_000_000
SHORT = Excitation(seconds=4.0, low_hz=0.5)
LONG = Excitation(seconds=8.0, low_hz=0.5)
KILL = RegimeLimits(kill_channel=7)


def plan(signal=SHORT, limits=None, **amplitudes):
    return Plan.of(signal, amplitudes or {"pitch": 0.05}, limits or Limits(), DT)


@dataclass
class Hover:
    """Feeds a loop sample by sample; a test changes what the vehicle tells. `sent` keeps every answer's correction."""

    loop: ExcitationLoop = None
    parameters: Parameters = field(default_factory=lambda: Parameters({"DOB_ENABLE": 1.0}, 0.05))
    now: float = 0.0
    sample: int = 0
    rates: tuple = (0.0, 0.0, 0.0)
    moment: tuple = (0.0, 0.0, 0.0)
    contained: tuple = (0.0, 0.0, 0.0)
    thrust: float = 0.5
    age: float = 1.0
    armed: bool = True
    landed: Landed = Landed.IN_AIR
    forward: bool = False
    mode: int = 4
    failsafe: bool = False
    pulse: int = 1000
    tilt: float | None = 0.02
    altitude: float | None = 10.0
    charge: float | None = 0.8
    telling: bool = True
    sent: list = field(default_factory=list)

    def __post_init__(self):
        self.loop = self.loop or ExcitationLoop(plan(), self.parameters, KILL)

    @property
    def stamp(self):
        return T0 + self.sample * DT_US

    def tell(self):
        """The slow messages."""
        loop, now = self.loop, self.now
        loop.heartbeat(self.armed, now)
        loop.guard.heartbeat(self.mode, now, failsafe=self.failsafe)
        loop.flight_state(FlightState(self.landed, self.forward), now)
        loop.rc_channels((1500,) * 6 + (self.pulse,), now)
        if self.tilt is not None:
            loop.guard.attitude((self.tilt, 0.0, 1.0), now)
        if self.altitude is not None:
            loop.guard.altitude(self.altitude, now)
        if self.charge is not None:
            loop.guard.battery(self.charge, now)

    def fly(self, count=1, *, gyro=True, moments=True):
        """`count` samples; returns the pitch corrections that answer them."""
        answers = []
        for _ in range(count):
            if self.telling and self.sample % 25 == 0:
                self.tell()
            if gyro:
                answer = self.loop.gyro(GyroSample(self.stamp, self.rates), self.now)
                self.loop.answer_left(self.stamp)
                answers.append(answer.correction[1])
                self.sent.append(answer.correction)
            if moments:
                self.loop.moment(AppliedMoment(self.stamp, self.moment, self.thrust, self.contained, self.age))
            self.sample += 1
            self.now += DT
        return answers

    def until(self, state, most=3000):
        for _ in range(most):
            self.fly()
            if self.loop.state is state:
                return self
        raise AssertionError(f"{state.name} not reached, still {self.loop.state.name}: {self.loop.why}")

    def excited(self):
        """In the middle of pitch, at the whole amplitude, where the signal is not about zero."""
        self.until(State.ACTIVE)
        for _ in range(200):
            if abs(self.fly()[0]) > 0.02:
                return self
        raise AssertionError("the signal stays small")

    def write(self, name, value):
        self.parameters.write(ParamWrite(name, value, None, True, Sender(255, 190)))
        self.loop.operator_wrote()

    def to_the_end(self, most=5000):
        for _ in range(most):
            if self.loop.over:
                return self
            self.fly()
        raise AssertionError(f"not over: {self.loop.state.name}, {self.loop.why}")


def hover(**more):
    signal = more.pop("signal", SHORT)
    limits = more.pop("limits", None)
    amplitudes = more.pop("amplitudes", {"pitch": 0.05})
    parameters = Parameters({"DOB_ENABLE": 1.0}, max(amplitudes.values()))
    loop = ExcitationLoop(plan(signal, limits, **amplitudes), parameters, KILL)
    return Hover(loop, parameters, **more)


@functools.cache
def _flown(state):
    plane = hover(signal=LONG)
    return plane.excited() if state is State.ACTIVE else plane.until(state)


def flown(state=State.ACTIVE):
    """A vehicle of its own in the middle of pitch, or where this state begins; flown there once."""
    return copy.deepcopy(_flown(state))


def degrees(angle):
    return math.radians(angle)

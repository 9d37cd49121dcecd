"""The companion on board, fed with values: what `dob_companion.companion.Companion` does to bytes, without bytes.

The loop that decides each correction is the daemon's own (`DobLoop`); here is only what stands around it on a link: the
facts in the order of the wire, rounded to the wire's single precision, and the answer held for the link's delay.
"""

import struct
from collections import deque
from collections.abc import Mapping

from dob_companion.artifact import DobDesign
from dob_companion.companion.dob import DobLoop
from dob_companion.companion.parameters import Parameters
from dob_companion.mavlink import AppliedMoment, FlightState, GyroSample, ParamWrite, Sender
from dob_companion.supervisor import State, Transition
from sitl.attitude import Vector
from sitl.flight import Flight
from sitl.vehicle import Sample
from sitl.wire.messages import landed_state

EVERY = 125
"""Samples between two reports of the vehicle on itself (armed, in the air): half a second."""

_SINGLE, _SINGLES = struct.Struct("<f"), struct.Struct("<3f")
_PILOT = Sender(255, 190)

Answer = tuple[int, Vector]


class Onboard:
    """One companion for one flight. `transitions` holds every change of state so far.

    `delay` is the age of a correction when it acts, in samples, 1 or more.
    """

    def __init__(self, design: DobDesign, parameters: Mapping[str, float], delay: int) -> None:
        self._parameters = Parameters(parameters)
        self._loop = DobLoop(design, self._parameters)
        self._under_way: deque[Answer] = deque()
        self._delay = delay
        self._samples = 0
        self.transitions: list[Transition] = []

    @property
    def state(self) -> State:
        """What the supervisor does now."""
        return self._loop.state

    @property
    def why(self) -> str:
        """What speaks against injecting, in words; "" when nothing does."""
        return self._loop.why

    def write(self, name: str, value: float) -> None:
        """The ground station writes a parameter."""
        self._parameters.write(ParamWrite(name, value, None, True, _PILOT))
        self._loop.operator_wrote()
        self.transitions += self._loop.take_transitions()

    def sample(self, flight: Flight, sample: Sample) -> None:
        """Answer one sample of `flight`, and hand over the answer that arrives before the next one."""
        now = sample.stamp_us * 1e-6
        if self._samples % EVERY == 0:
            self._loop.watch.regime.heartbeat(flight.vehicle.armed, now)
            self._loop.watch.flight_state(FlightState(landed_state(flight.vehicle), forward=False))
        self._samples += 1
        answer = self._loop.gyro(GyroSample(sample.stamp_us, sample.gyro), now)
        thrust = _SINGLE.unpack(_SINGLE.pack(sample.thrust))[0]
        contained = _SINGLES.unpack(_SINGLES.pack(*sample.correction))
        self._loop.moment(AppliedMoment(sample.stamp_us, sample.u_e, thrust, contained, float(sample.age)))
        self.transitions += self._loop.take_transitions()
        if answer is not None:
            self._under_way.append((answer.stamp_us, _SINGLES.unpack(_SINGLES.pack(*answer.correction))))
        if len(self._under_way) >= self._delay:
            flight.answer(*self._under_way.popleft())

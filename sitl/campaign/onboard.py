"""The companion on board, fed with values: what `dob_companion.companion.Companion` does to bytes, without bytes.

The loop that decides each correction is the daemon's own (`DobLoop`); here is only what stands around it on a link: the
facts in the order of the wire, rounded to the wire's single precision. What the link itself does is `Flight`'s.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from dob_companion.artifact import DobDesign
from dob_companion.companion.core import TELEMETRY_EVERY
from dob_companion.companion.dob import Answer, DobLoop
from dob_companion.companion.parameters import Parameters
from dob_companion.mavlink import AppliedMoment, FlightState, GyroSample, Landed, ParamWrite, Sender
from dob_companion.supervisor import State
from sitl.attitude import Vector
from sitl.autopilot.imu import Gyro
from sitl.autopilot.vehicle import Sample
from sitl.flight import Flight
from sitl.wire.messages import landed_state
from sitl.wire.stamping import Stamping

REPORT_EVERY = 125
"""Samples between two reports of the vehicle on itself (armed, in the air): half a second."""

_SINGLE, _SINGLES = struct.Struct("<f"), struct.Struct("<3f")
_PILOT = Sender(255, 190)


class Onboard:
    """One companion for one flight: call `sample` with each sample flown.

    With `prompt` there is no link: a sample is answered while it is being flown, between gyro and controller, and the
    correction acts in it, at an age of 0; stamps are exact then. A link answers after it, at an age of 1 or more, under
    the stamps that the vehicle's clock makes.
    """

    def __init__(self, design: DobDesign, parameters: Mapping[str, float], flight: Flight, *, prompt: bool) -> None:
        self._parameters = Parameters(parameters, design.limit)
        self._loop = DobLoop(design, self._parameters)
        self._flight = flight
        self._samples = self._answered = 0
        self._prompt = prompt
        self._stamping = Stamping(None if prompt else flight.scenario.clock, flight.seed)
        if prompt:
            gyro = flight.vehicle.gyro
            flight.vehicle.gyro = _Tapped(gyro.bias, gyro.latency, gyro.quantum, heard=self._answer)

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

    def sample(self, sample: Sample) -> None:
        """Hear of a sample that was flown, and answer it unless the link loses it."""
        flight, loop, said = self._flight, self._loop, self._stamping.stamped(sample)
        now = sample.stamp_us * 1e-6
        if self._samples % REPORT_EVERY == 0:
            loop.heartbeat(flight.vehicle.armed, now)
            loop.flight_state(FlightState(Landed(landed_state(flight.vehicle)), forward=False), now)
        self._samples += 1
        if flight.channel.pair_lost and not self._prompt:
            return
        answer = None if self._prompt else loop.gyro(GyroSample(said.stamp_us, sample.gyro), now)
        self._tell(sample.stamp_us)
        thrust = _SINGLE.unpack(_SINGLE.pack(sample.thrust))[0]
        contained = _SINGLES.unpack(_SINGLES.pack(*sample.correction))
        loop.moment(AppliedMoment(said.stamp_us, sample.u_e, thrust, contained, float(sample.age)))
        loop.take_transitions()
        if self._prompt:
            flight.log.answer(sample.stamp_us)  # given already, before there was a row to note it in
        elif answer is not None:
            self._give(answer)

    def _answer(self, gyro: Vector) -> None:
        """Answer the sample that is being flown."""
        stamp = self._flight.vehicle.now_us
        answer = self._loop.gyro(GyroSample(stamp, _SINGLES.unpack(_SINGLES.pack(*gyro))), stamp * 1e-6)
        if answer is not None:
            self._give(answer)

    def _give(self, answer: Answer) -> None:
        self._loop.answer_left(answer.stamp_us)
        correction = _SINGLES.unpack(_SINGLES.pack(*answer.correction))
        self._flight.answer(self._stamping.exact(answer.stamp_us), correction)

    def _tell(self, stamp_us: int) -> None:
        """The daemon's telemetry, of which the vehicle records the state."""
        self._answered += 1
        if self._answered % TELEMETRY_EVERY == 0:
            self._flight.log.state(stamp_us, self._loop.state)


@dataclass(slots=True)
class _Tapped(Gyro):
    """A gyro whose readings are heard as soon as they are made."""

    heard: Callable[[Vector], None] = field(kw_only=True)

    def read(self, rate: Vector, noise: Vector) -> Vector:
        reading = Gyro.read(self, rate, noise)  # a slotted dataclass is made anew, so super() would miss
        self.heard(reading)
        return reading

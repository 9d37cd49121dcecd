"""One flight as one pure object: weather, vehicle, script, link, corrections and recorder, a sample at a time."""

from math import pi, sin

from sitl.airframe.surroundings import Surroundings
from sitl.attitude import ZERO, Quaternion, Vector, turned_back
from sitl.autopilot.aircraft import Aircraft, aircraft_named
from sitl.autopilot.correction import CorrectionInput, Verdict
from sitl.autopilot.vehicle import Sample, Vehicle
from sitl.channel import Channel
from sitl.constants import DT
from sitl.log import FlightLog
from sitl.scenario.events import Stage, Timeline
from sitl.scenario.script import Phase, Script
from sitl.scenario.spec import Disturbance, Pull, Scenario
from sitl.weather.disturbance import CALM, Weather, noise_sigma
from sitl.weather.gusts import Air


class Flight:
    """A scenario being flown.

    `scale` is the size of the disturbance per axis (see `calibration`): the standard deviation of noise or the full
    amplitude of a pull, normalized torque or Nm. With `await_arming` it stays on the ground until armed and sent up
    from outside. `record=False` leaves `log` empty, for flights without an end. `delay_samples` is the link's: the
    least age at which a correction acts.
    """

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        scale: Vector = ZERO,
        *,
        await_arming: bool = False,
        aircraft: Aircraft | None = None,
        record: bool = True,
        delay_samples: int = 1,
    ) -> None:
        disturbance = scenario.disturbance or Disturbance(1.0, ZERO)
        self.scenario, self.seed, self.delay_samples = scenario, seed, delay_samples
        self.vehicle = Vehicle(aircraft or aircraft_named(scenario.airframe))
        self.script = Script(scenario, self.vehicle, await_arming)
        self.channel = Channel(seed, delay_samples)
        self.log = FlightLog()
        self.newest: Sample | None = None
        self._record = record
        lead_s = scenario.windows.lead_s if scenario.windows else 0.0
        self._stage = Stage(self.vehicle, self.channel, scenario.hover_altitude)
        self._timeline = Timeline(scenario.events, self._stage, lead_s, 1.0 / DT)
        self._air = Air(scenario.wind, seed, scenario.hover_altitude, lead_s, DT) if scenario.wind else None
        self._windy = False
        self._pull, self._scale, self._as_moment = disturbance.pull, scale, disturbance.moment
        noise = ZERO if disturbance.pull else scale
        self._weather = Weather(seed, disturbance.bandwidth_hz, noise, noise_sigma(scenario.noise_dbw))
        self._done = 0  # samples of the running segment
        self._corrections = CorrectionInput()

    @property
    def complete(self) -> bool:
        """The script came to its end."""
        return self.script.phase is Phase.COMPLETE

    def step(self) -> tuple[Sample, list[str]]:
        """Fly the next sample; returns it and the notices of the script. Raises FlightFailedError."""
        script, frame = self.script, self.vehicle.airframe
        if script.stream is not None:
            self._begin(script.stream)
            script.stream = None
        window = script.window
        self._timeline.sample()
        self._deliver()
        around, noise = self._around(frame.attitude)
        position = frame.position
        sample = self.vehicle.step(around, noise, self._corrections)
        self.channel.sample(sample.stamp_us)
        if self._record:
            self.log.add(sample, window, around, position)
        self.newest = sample
        return sample, script.after_sample(sample)

    def answer(self, stamp_us: int, correction: Vector) -> Verdict:
        """Take in a companion's answer to the sample stamped `stamp_us`; ignored or not, it is an answer."""
        if not self.channel.take(stamp_us, correction, self.vehicle.now_us):
            return Verdict.LOST
        self.log.answer(stamp_us)
        return self._deliver().get(stamp_us, Verdict.HELD)

    def _deliver(self) -> dict[int, Verdict]:
        """Offer what has come through the link by now."""
        now = self.vehicle.now_us
        return {stamp: self._corrections.offer(stamp, value, now) for stamp, value in self.channel.due(now)}

    def _begin(self, stream: int) -> None:
        """The stream of a segment begins with the next sample: everything as it was, then as the scenario says."""
        self._weather.begin(stream)
        self.channel.begin(stream)
        self._timeline.begin(eventful=stream != CALM)
        self._windy = self._air is not None and stream != CALM
        if self._air is not None:
            self._air.begin(stream)
        self._done = 0

    def _around(self, attitude: Quaternion) -> tuple[Surroundings, Vector]:
        """What surrounds the vehicle in the next sample, and the gyro's noise."""
        torque, noise = self._weather.sample()
        moment = wind = wind_rate = ZERO
        if self._pull and not self._weather.calm:
            torque = _pulled(self._pull, self._scale, self._done * DT)
        if self._as_moment:
            torque, moment = ZERO, torque
        if self._windy and self._air:
            wind, rotation = self._air.sample()
            wind_rate = turned_back(attitude, rotation)
        self._done += 1
        return Surroundings(torque, wind, wind_rate, moment, self._stage.wall_m), noise


def _pulled(pull: Pull, scale: Vector, t: float) -> Vector:
    grown = min(1.0, t / pull.growth_s) if pull.growth_s else 1.0
    now = grown * sin(2.0 * pi * pull.frequency_hz * t)
    return (now * scale[0], now * scale[1], now * scale[2])

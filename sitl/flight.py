"""One flight as one pure object: weather, vehicle, script, corrections and recorder, advanced a sample at a time."""

from sitl.attitude import ZERO, Vector
from sitl.correction import CorrectionInput, Verdict
from sitl.dynamics import Airframe, LinearAirframe
from sitl.log import FlightLog
from sitl.scenario import Scenario
from sitl.script import Phase, Script
from sitl.surroundings import Surroundings
from sitl.vehicle import Sample, Vehicle
from sitl.weather import Weather, noise_sigma


class Flight:
    """A scenario being flown.

    `scale` is the disturbance's standard deviation per axis, normalized torque (see `calibration`). With
    `await_arming` it stays on the ground until armed and sent up from outside. `record=False` leaves `log` empty, for
    flights without an end.
    """

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        scale: Vector = ZERO,
        *,
        await_arming: bool = False,
        airframe: Airframe | None = None,
        record: bool = True,
    ) -> None:
        bandwidth = scenario.disturbance.bandwidth_hz if scenario.disturbance else 1.0
        self.scenario, self.seed = scenario, seed
        self.vehicle = Vehicle(airframe or LinearAirframe())
        self.script = Script(scenario, self.vehicle, await_arming)
        self.log = FlightLog()
        self._record = record
        self.newest: Sample | None = None
        self._weather = Weather(seed, bandwidth, scale, noise_sigma(scenario.noise_dbw))
        self._corrections = CorrectionInput()

    @property
    def complete(self) -> bool:
        """The script came to its end."""
        return self.script.phase is Phase.COMPLETE

    def step(self) -> tuple[Sample, list[str]]:
        """Fly the next sample; returns it and the notices of the script. Raises FlightFailedError."""
        script = self.script
        if script.stream is not None:
            self._weather.begin(script.stream)
            script.stream = None
        window = script.window
        disturbance, noise = self._weather.sample()
        sample = self.vehicle.step(Surroundings(torque=disturbance), noise, self._corrections)
        if self._record:
            self.log.add(sample, window)
        self.newest = sample
        return sample, script.after_sample(sample)

    def answer(self, stamp_us: int, correction: Vector) -> Verdict:
        """Take in a companion's answer to the sample stamped `stamp_us`; ignored or not, it is an answer."""
        self.log.answer(stamp_us)
        return self._corrections.offer(stamp_us, correction, self.vehicle.now_us)

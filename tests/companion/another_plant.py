"""An aircraft that is not the one designed for, flown with the companion's loop on board, in simulated time."""

from dataclasses import dataclass, field, replace

import numpy as np

from dob_companion.artifact import DobDesign
from dob_companion.lti.filters import butterworth
from dob_companion.supervisor import FirstEnabling, State, Steps
from sitl.airframe.linear import PITCH, ROLL, YAW, LinearAirframe
from sitl.attitude import Vector
from sitl.autopilot.aircraft import linear
from sitl.autopilot.imu import Gyro
from sitl.campaign.onboard import Onboard
from sitl.constants import DT
from sitl.flight import Flight
from sitl.scenario.script import Phase
from sitl.scenario.spec import Disturbance, Scenario, Windows

AT_ONCE = FirstEnabling(shares=())
GUSTS = (0.005, 0.005, 0.005)


@dataclass(slots=True)
class FilteredGyro(Gyro):
    """A gyro behind a second-order low-pass, as autopilots have one; `corner_hz` 0 for none."""

    corner_hz: float = 0.0
    _x: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))

    def read(self, rate: Vector, noise: Vector) -> Vector:
        reading = Gyro.read(self, rate, noise)
        if not self.corner_hz:
            return reading
        A, B, C, D = butterworth(DT, self.corner_hz)
        inputs = np.array([reading])
        filtered = (C @ self._x + D @ inputs)[0]
        self._x = A @ self._x + B @ inputs
        return tuple(filtered.tolist())


@dataclass(frozen=True)
class Flown:
    """Arrays (N, …) from switching on: true rates, rad/s, the fade f, the supervisor's state; and the last words."""

    rate: np.ndarray
    fade: np.ndarray
    state: np.ndarray
    why: str

    @property
    def recognized(self):
        """Sample at which the fade-out begins."""
        return int(np.argmax(self.state == State.RAMP_OUT))

    @property
    def onset(self):
        """Sample of the half-wave that was the first to rise above 0.05 rad/s."""
        return int(np.argmax(np.abs(self.rate).max(axis=1) > 0.05))

    @property
    def zero(self):
        """First sample from the fade-out on whose correction is exactly zero."""
        return self.recognized + int(np.argmax(self.fade[self.recognized :] == 0.0))


def fly(
    design: DobDesign,
    delay=1,
    *,
    gain=1.0,
    late=0.0,
    filter_hz=0.0,
    gusts=(0.0, 0.0, 0.0),
    steps=AT_ONCE,
    seed=1,
) -> Flown:
    """Two seconds in hover, then three switched on.

    `gain` is the plant's over the design's, `late` the gyro's latency in samples, `filter_hz` the corner of its filter;
    `gusts` are noise through 1 Hz of this standard deviation, normalized torque.
    """
    scenario = Scenario("another", "another plant", 1.0, -68.0, Disturbance(1.0, gusts), Windows(1.0, 1.0, 2.5))
    axes = tuple(replace(axis, gain=gain * axis.gain) for axis in (ROLL, PITCH, YAW))
    flight = Flight(scenario, seed, gusts, aircraft=linear(LinearAirframe(axes)), delay_samples=delay)
    flight.vehicle.gyro = FilteredGyro(latency=late, corner_hz=filter_hz)
    onboard = Onboard(design, {}, flight, prompt=False)
    loop = onboard._loop
    loop._steps = Steps(steps, design.dt)
    rows, on = [], None
    while not flight.complete:
        sample, _ = flight.step()
        onboard.sample(sample)
        rows.append((*sample.rate, loop.shaper.f, loop.state))
        if flight.script.phase is Phase.WAIT_OBSERVER:
            on = len(rows)
            onboard.write("DOB_ENABLE", 1.0)
            flight.script.observer_reported(True)
    assert np.abs(np.array(rows)[:on, :3]).max() < 0.5, "the aircraft does not fly without us either"
    array = np.array(rows[on:])
    return Flown(array[:, :3], array[:, 3], array[:, 4].astype(int), loop.why)

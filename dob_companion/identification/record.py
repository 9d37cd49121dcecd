"""What was seen of one aircraft in one stretch of time, whoever wrote it down: a link, a log of an autopilot, a table.

All signals of a record stand on one clock, seconds from the record's begin, each with its own times: nothing here is
resampled. Hover axes (roll, pitch, yaw; x forward, z down in hover), rad, rad/s, normalized torque.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Signal:
    """Values over time.

    time    s, shape (n,), strictly rising; where nothing came the step between two times is long
    values  shape (n, channels), finite
    """

    time: Floats
    values: Floats


@dataclass(frozen=True, slots=True)
class Facts:
    """A yes or no over time: `holds[k]` from `time[k]` on until the next; unknown before the first."""

    time: Floats
    holds: NDArray[np.bool_]

    def at(self, time: Floats) -> NDArray[np.bool_]:
        """What holds at these times; False where it is unknown."""
        known = np.searchsorted(self.time, time, side="right") - 1
        if not len(self.time):
            return np.zeros(len(time), bool)
        return np.where(known >= 0, self.holds[np.maximum(known, 0)], False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One stretch of flight data.

    source             file or link, for messages
    make               of the autopilot ("ArduPilot", "PX4"; "" when unknown or our simulated vehicle)
    vehicle            kind of vehicle in the words of its autopilot ("quadrotor", "rover", …); "" when unknown
    rates              body rates, rad/s (3 channels)
    moment             normalized torque that is applied from its time on, mixer's limits and injected part included
    injected           what was added to the moment for the sake of excitation (or by a disturbance observer), and is
                       contained in `moment`; None when the record does not tell, which is not the same as zero
    rate_setpoint      what the rate controller follows, rad/s
    attitude_setpoint  roll, pitch, yaw angles asked of the attitude controller, rad
    attitude           roll, pitch, yaw angles, rad
    thrust             collective, 0…1 (1 channel)
    armed, flying      where the source tells; None where it does not
    saturated          the mixer could not give what was asked
    parameters         of the autopilot, by its own names
    rates_filtered     True when `rates` have passed the gyro filter that the rate controller sees (the record is "what
                       the link shows" of ArduPilot), False when they have not, None when unknown
    moment_read_late_s None where a moment acts from its time on until the next, as everywhere else. Else it was read by
                       a program beside the controller: the controller's part is a sample of what acts around its time,
                       and the injected part acts from so much later on
    remarks            what the reader found odd and how it was taken, one line each: for the user
    """

    source: str
    rates: Signal
    moment: Signal
    make: str = ""
    vehicle: str = ""
    injected: Signal | None = None
    rate_setpoint: Signal | None = None
    attitude_setpoint: Signal | None = None
    attitude: Signal | None = None
    thrust: Signal | None = None
    armed: Facts | None = None
    flying: Facts | None = None
    saturated: Facts | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    rates_filtered: bool | None = None
    moment_read_late_s: float | None = None
    remarks: tuple[str, ...] = ()

    @property
    def moment_read_hz(self) -> float | None:
        """How often the moment was read by a program beside the controller; None where none did."""
        times = self.moment.time
        if self.moment_read_late_s is None or len(times) < 2:
            return None
        return float((len(times) - 1) / (times[-1] - times[0]))

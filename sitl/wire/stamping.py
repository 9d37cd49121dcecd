"""What the vehicle's clock says of its samples, and back: on the wire that clock counts, in the record exact time."""

from sitl.autopilot.imu import Stamps
from sitl.autopilot.vehicle import Sample
from sitl.scenario.spec import Clock

MEMORY = 256
"""Samples whose stamps are remembered; an answer to an older one is nobody's."""

NOBODY = 0
"""Exact time of a stamp that belongs to no sample."""


class Stamping:
    """Stamps samples with the clock of a scenario; without one, stamps are exact."""

    def __init__(self, clock: Clock | None, seed: int) -> None:
        self._stamps: Stamps | None = None
        if clock:
            self._stamps = Stamps(seed, grid_us=clock.grid_us, jitter_us=clock.jitter_us, skew_ppm=clock.skew_ppm)
        self._exact: dict[int, int] = {}

    def stamped(self, sample: Sample) -> Sample:
        """The sample with the stamp that goes over the wire; one call per sample."""
        if self._stamps is None:
            return sample
        stamp = self._stamps.stamp(sample.stamp_us)
        self._exact[stamp] = sample.stamp_us
        if len(self._exact) > MEMORY:
            del self._exact[next(iter(self._exact))]
        return sample._replace(stamp_us=stamp)

    def exact(self, stamp_us: int) -> int:
        """Exact time of the sample that bore this stamp."""
        return stamp_us if self._stamps is None else self._exact.get(stamp_us, NOBODY)

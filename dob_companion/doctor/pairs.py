"""Gyro rates and the moments of the vehicle's own controller on the grid of a design, as the daemon takes them in
(`companion.samples`): stamps of both need not coincide, nor a moment come with every sample."""

from collections.abc import Iterator

import numpy as np

from dob_companion.artifact import DobDesign
from dob_companion.companion.samples import AHEAD, NOTHING, Arrival, Samples, revisable
from dob_companion.mavlink import AppliedMoment, GyroSample
from dob_companion.mavlink.facts import Axes3
from dob_companion.observer import GyroModel, missing_samples


class Pairs:
    """Of one vehicle that flies by itself: what a companion adds to its moments is taken out of them."""

    def __init__(self, design: DobDesign) -> None:
        missing = missing_samples(design)
        self._model = GyroModel(design, longest=AHEAD, revisable=revisable(missing))
        self._samples = Samples(design.dt, missing, self._model)

    def gyro(self, sample: GyroSample) -> Iterator[tuple[Axes3, Axes3] | None]:
        """Rates, rad/s, and moment, normalized torque, of each interval that this sample completes; None where they do
        not follow what came before."""
        if self._samples.known(sample.stamp_us) or not np.all(np.isfinite(sample.rates)):
            return
        arrived = self._samples.gyro(sample.stamp_us, sample.rates)
        if arrived.arrival is not Arrival.NEXT:
            self._model.reset()
            yield None
            return
        for inputs in arrived.finished:
            self._model.advance(*inputs)
            yield inputs

    def moment(self, applied: AppliedMoment) -> None:
        """Take in a moment."""
        x, y, z = np.subtract(applied.moment, applied.correction)
        if np.all(np.isfinite((x, y, z))):
            own = float(x), float(y), float(z)
            for revision in self._samples.moment(applied.stamp_us, own, NOTHING, applied.read_late_us) or ():
                self._model.revise(*revision)

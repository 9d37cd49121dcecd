"""The moment as a script beside the rate controller reports it, as ArduPilot's does: read now and then, not told by who
makes it.

It runs some 200 times a second, at any time within a loop of the controller. What the controller puts out is then that
of the sample that is ending; what the script adds acts with the next one.
"""

from random import Random

from sitl.autopilot.vehicle import Sample
from sitl.constants import DT

LOOP_US = 2500
RATE_HZ = 200.0
MOMENTS = ("held", "read")
"""How moments are reported: of every sample, by who makes them, with its stamp; or so."""


class Reading:
    """One flight's script; its times follow from the seed."""

    def __init__(self, seed: int) -> None:
        self._random = Random(f"script {seed}")
        self._before: Sample | None = None

    def of(self, sample: Sample) -> Sample | None:
        """What it reports around the begin of a sample, stamped when it was read; None where it did not run."""
        before, self._before = self._before, sample
        runs, ahead = self._random.random() < RATE_HZ * DT, self._random.randrange(LOOP_US)
        if before is None or not runs:
            return None
        pairs = zip(before.u_e, before.correction, sample.correction, strict=True)
        roll, pitch, yaw = (u - old + new for u, old, new in pairs)
        return sample._replace(stamp_us=sample.stamp_us - ahead, u_e=(roll, pitch, yaw))

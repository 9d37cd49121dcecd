"""In which axes does a vehicle measure its rates, if not in those that it is said to?

The sign and axis check (`supervisor.axes`) sees that something is wrong; here it is asked which of the 24 rotations by
quarter turns would be right. The same check runs three times, on the rates as they are and moved round by one and two
axes: so each moment is compared with each rate by the plant and controller of the moment's own axis. A rotation fits
where all axes of the design agree under it, each with motion above the gyro's noise; of a design for two axes the
third follows from the determinant.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import AXES, DobDesign
from dob_companion.mavlink.axes import HOVER, ROTATIONS, AxisMap
from dob_companion.supervisor import AxisCheck
from dob_companion.supervisor.axes import PROOF

LEAST_AXES = 2
"""A design for one axis alone cannot tell how the others lie."""


class RotationSearch:
    """Watches rates and moments as `AxisCheck` does."""

    def __init__(self, design: DobDesign) -> None:
        self._checks = tuple(AxisCheck(design) for _ in range(3))
        self._covered = sorted(AXES.index(axis) for block in design.blocks for axis in block.axes)

    def interrupt(self) -> None:
        """The next sample does not follow the one before."""
        for check in self._checks:
            check.interrupt()

    def add(self, y_n: Sequence[float], u: Iterable[float]) -> None:
        """One sample: rates, rad/s, and the controller's own moment, normalized torque."""
        for shift, check in enumerate(self._checks):
            check.add((*y_n[shift:], *y_n[:shift]), u)

    def found(self) -> AxisMap | None:
        """The rotation by which the rates would answer the moments; None where they do so as they are, and where no
        rotation fits or more than one."""
        agreement = self._agreement()
        fitting = [each for each in ROTATIONS if self._fits(each, agreement)]
        return fitting[0] if len(fitting) == 1 and fitting[0] != HOVER else None

    def _agreement(self) -> NDArray[np.float64]:
        """(3, 3) Of each moment with each rate."""
        found = np.zeros((3, 3))
        for shift, check in enumerate(self._checks):
            found[range(3), [(axis + shift) % 3 for axis in range(3)]] = check.agreement
        return found

    def _fits(self, rotation: AxisMap, agreement: NDArray[np.float64]) -> bool:
        signs = np.where(rotation.negated, -1.0, 1.0)
        own = (signs * agreement[range(3), rotation.of])[self._covered]
        return len(own) >= LEAST_AXES and bool(np.all(own >= PROOF))

"""What an observer must keep at every angle, as the programmes take it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Indices = NDArray[np.int64]

BROKEN = 1e-5
"""Share of a limit by which it may be exceeded between the angles watched, for the programme to count as solved."""


@dataclass(slots=True, eq=False)
class Limit:
    """|offset + slope F| <= size at each angle, or Re(offset + slope F) >= size where `half_plane`, all of a disk of
    radius |around[0] + around[1] F| where there is one."""

    name: str
    offset: Complex
    slope: Complex
    size: float
    half_plane: bool = False
    around: tuple[Complex, Complex] | None = None
    watched: Indices = field(default_factory=lambda: np.zeros(0, np.int64))

    def excess(self, F: Complex) -> Array:
        """By how much it is broken at each angle, as a share of its size."""
        value = self.offset + self.slope * F
        if not self.half_plane:
            return np.asarray(np.abs(value) / self.size - 1.0)
        radius = np.abs(self.around[0] + self.around[1] * F) if self.around else 0.0
        return np.asarray(self.size - value.real + radius)

    def watch(self, excess: Array) -> bool:
        """Add the angles where it is broken most, each the worst of its surroundings; whether there were any."""
        high = np.concatenate([[-np.inf], excess, [-np.inf]])
        tops = (excess > BROKEN) & (excess >= high[:-2]) & (excess > high[2:])
        new = np.setdiff1d(np.flatnonzero(tops), self.watched)
        self.watched = np.union1d(self.watched, new).astype(np.int64)
        return len(new) > 0

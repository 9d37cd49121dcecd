"""What an observer must keep at every angle, as the programmes take it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Indices = NDArray[np.int64]

BROKEN = 1e-5
"""Share of a limit by which it may be exceeded between the angles watched, for the programme to count as solved."""

AROUND = 0.75 * np.pi
"""Values on the circle's upper half that have turned by more than this, at angle pi, go around the origin: at whole
samples it is a multiple of pi."""


@dataclass(slots=True, eq=False)
class Limit:
    """|offset + slope F| <= size at each angle, or Re(slant (offset + slope F)) >= size where `half_plane`, all of a
    disk of radius |around[0] + around[1] F| where there is one."""

    name: str
    offset: Complex
    slope: Complex
    size: float
    half_plane: bool = False
    around: tuple[Complex, Complex] | None = None
    watched: Indices = field(default_factory=lambda: np.zeros(0, np.int64))
    slant: Complex = field(init=False)
    """How lines stand: its angle, and by its magnitude how far from the origin."""

    def __post_init__(self) -> None:
        """Lines upright."""
        self.upright()

    def upright(self) -> None:
        """All lines parallel to the imaginary axis."""
        self.slant = np.ones(len(self.offset), np.complex128)

    def across(self, F: Complex) -> None:
        """Lines across the way from the origin to an F's values; upright where those go around the origin.

        What is beyond all these lines goes as often around the origin as they do: not at all. So that nothing slips
        through between two angles, they stand as far from the origin as the values move from one to the next, as far
        as F itself does.
        """
        values = self.offset + self.slope * F
        turn, moves, sizes = np.unwrap(np.angle(values)), np.abs(np.diff(values)), np.abs(values)
        self.upright()
        if max(abs(turn[0]), abs(turn[-1])) < AROUND:
            apart = np.maximum(np.append(moves, 0.0), np.append(0.0, moves))
            self.slant = np.exp(-1j * turn) * self.size / np.clip(apart, self.size, np.maximum(sizes, self.size))

    def excess(self, F: Complex) -> Array:
        """By how much it is broken at each angle, as a share of its size."""
        value = self.offset + self.slope * F
        if not self.half_plane:
            return np.asarray(np.abs(value) / self.size - 1.0)
        value = self.slant * value
        radius = np.abs(self.around[0] + self.around[1] * F) if self.around else 0.0
        return np.asarray(self.size - value.real + radius)

    def watch(self, excess: Array) -> bool:
        """Add the angles where it is broken most, each the worst of its surroundings; whether there were any."""
        high = np.concatenate([[-np.inf], excess, [-np.inf]])
        tops = (excess > BROKEN) & (excess >= high[:-2]) & (excess > high[2:])
        new = np.setdiff1d(np.flatnonzero(tops), self.watched)
        self.watched = np.union1d(self.watched, new).astype(np.int64)
        return len(new) > 0

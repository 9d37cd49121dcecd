"""The best observers for several sets of limits at once: each starts from what the stricter ones found.

An observer that keeps stricter limits keeps looser ones, and for its poles the programme finds one at least as good. So
no row of a trade-off attenuates less than a stricter one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.synthesis.optimal.descent import descend, grown, started
from dob_companion.synthesis.optimal.factors import Factors
from dob_companion.synthesis.optimal.problem import Axis, Responses, Spectrum, Wanted, grid, responses
from dob_companion.synthesis.optimal.programme import Band, Programme, Solved
from dob_companion.synthesis.optimal.realization import left_zeros, realized

Array = NDArray[np.float64]

ORDER, MOST_ORDER, FREE = 6, 8, 4
"""States of an observer by default and at most; of a plant of more than two (four) states FREE more than it has, which
leaves its numerator five numbers. With three, plants of four and five states reached half of what they do with five.
Two more than that bring half a percent to two, and the LMI takes long for the weights of still more."""

WORTH = 1.001
"""An order is raised only when this much is gained: fewer states are easier to trust."""


SHARP, AROUND = 0.9, np.geomspace(1.0 / 1.15, 1.15, 80)
"""Modes from this radius on get angles of their own, at these multiples of theirs."""

ASIDE, BROAD = 4, 1.2
"""Times that T_f is held to the right of the origin around its zeros, and how far to either side of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The best observer within limits: `value` is the RMS over the gains of attitude error on / off."""

    wanted: Wanted
    solved: Solved
    radius: float

    @property
    def order(self) -> int:
        """States."""
        return len(self.solved.x)

    def observer(self, axis: Axis) -> Any:
        """D(z), inputs [y_n; u_e]."""
        return realized(axis, self.solved.x, self.radius, self.solved.b)


def least_order(axis: Axis) -> int:
    """States that an observer of this plant needs at least for its numerator to have three numbers."""
    return axis.order + 2


def usual_order(axis: Axis) -> int:
    """States at most where nothing is stated."""
    return max(ORDER, axis.order + FREE)


def allowed_order(axis: Axis, stated: int | None) -> int:
    """States at most."""
    usual = usual_order(axis)
    return usual if stated is None else min(stated, max(MOST_ORDER, usual))


def looser(a: Wanted, b: Wanted) -> bool:
    """Whether all limits of a are at most as strict as b's."""
    return (
        a.disk_margin <= b.disk_margin
        and a.noise >= b.noise
        and (a.peak or np.inf) >= (b.peak or np.inf)
        and a.delay_margin <= b.delay_margin
        and a.slowest_s >= b.slowest_s
        and (a.moment_hz or np.inf) >= (b.moment_hz or np.inf)
    )


class Search:
    """One axis in one weather."""

    def __init__(self, axis: Axis, spectrum: Spectrum, order: int = ORDER) -> None:
        self.axis, self.spectrum, self.order = axis, spectrum, order
        self.on: Responses = responses(axis, np.union1d(grid(), _around_modes(axis)))
        self.factors: Factors | None = None
        """Uncertain plants that must be stable too, on the angles of `on`."""
        self.right: tuple[Band, ...] = ()
        """Where T_f stays right of the imaginary axis (`weighable`)."""

    def programme(self, wanted: Wanted) -> Programme:
        """For one set of limits."""
        return Programme(self.on, self.axis.order, self.spectrum, wanted, self.factors, self.right)

    def best(self, wanted: Wanted) -> Found | None:
        """From generic poles, growing; None where nothing keeps the limits."""
        programme, begun = self.programme(wanted), self.quick(wanted)
        best = begun.solved if begun else None
        while best is not None and len(best.x) < self.order:
            tried = [
                grown(programme, best, most) for most in range(len(best.x) + 1, min(len(best.x) + 2, self.order) + 1)
            ]
            more = min((each for each in tried if each), key=lambda each: each.value, default=None)
            if more is None or more.value * WORTH > best.value:
                break
            best = more
        return Found(wanted, _aimed(programme, best), programme.radius) if best else None

    def quick(self, wanted: Wanted) -> Found | None:
        """From generic poles, as few as do; None where nothing keeps the limits."""
        programme = self.programme(wanted)
        solved = started(programme, min(least_order(self.axis), self.order))
        return Found(wanted, solved, programme.radius) if solved else None

    def front(self, first: Found, others: Sequence[Wanted]) -> list[Found | None]:
        """The best found and the best for each of others; none is less good than one for stricter limits.

        None for limits that nothing keeps.
        """
        wanted = [first.wanted, *others]
        found: dict[int, Found | None] = {0: first}
        for at in _strictest_first(range(1, len(wanted)), wanted):
            found[at] = self._from([each for each in found.values() if each], wanted[at]) or self.best(wanted[at])
        for at in _strictest_first(range(len(wanted)), wanted):
            stricter = [each for each in found.values() if each and looser(wanted[at], each.wanted)]
            better = self._from(stricter, wanted[at], below=own.solved.value if (own := found[at]) else np.inf)
            found[at] = better or found[at]
        return [found[at] for at in range(len(wanted))]

    def nearby(self, found: Found, wanted: Wanted) -> Found | None:
        """The best for slightly other limits, from the poles of one found."""
        return self._from([found], wanted)

    def weighable(self, found: Found) -> Found | None:
        """The same when it is the optimum of weights, otherwise the best near it that is; None where none is found.

        A sharp mode may draw T_f around the origin, so that it has zeros outside the unit circle and no stable W_d has
        its poles there. From here on T_f stays to the right around their angles, for all that is searched.
        """
        for _ in range(ASIDE):
            zeros = left_zeros(found.observer(self.axis), self.axis.delay)
            outside = np.unique(np.abs(np.angle(zeros[np.abs(zeros) >= 1.0])))
            if not len(outside):
                return found
            self.right += tuple((angle / BROAD, angle * BROAD) for angle in outside.tolist())
            tried = [self.nearby(found, found.wanted), self.best(found.wanted)]
            nearby = min((each for each in tried if each), key=lambda each: each.solved.value, default=None)
            if nearby is None:
                return None
            found = nearby
        return None

    def _from(self, others: Sequence[Found], wanted: Wanted, below: float = np.inf) -> Found | None:
        """The best descent from the poles of others; None where none begins below a value."""
        programme = self.programme(wanted)
        begun = [_begun(programme, each, aims=True) for each in others]
        if not any(begun):  # what suits a looser one's F may leave nothing
            begun = [_begun(programme, each, aims=False) for each in others]
        best = min((each for each in begun if each), key=lambda each: each.value, default=None)
        if best is None or best.value >= below:
            return None
        return Found(wanted, _aimed(programme, best), programme.radius)


def _begun(programme: Programme, found: Found, *, aims: bool) -> Solved | None:
    programme.aim(found.solved.F if aims else None)
    return programme.solve(found.solved.x)


def _aimed(programme: Programme, best: Solved) -> Solved:
    """A descent from there with the delay margin's lines set anew at each answer; never worse."""
    programme.aim(best.F)
    end = descend(programme, best.x)
    return end if end and end.value <= best.value else best


def _around_modes(axis: Axis) -> Array:
    """Angles at the plant's resonances and between them, where a grid may have none."""
    roots = np.concatenate([np.roots(axis.m), np.roots(axis.n)])
    sharp = roots[(np.abs(roots) > SHARP) & (roots.imag > 0.0)]
    around = np.concatenate([np.zeros(0), *(np.angle(root) * AROUND for root in sharp)])
    return around[around < np.pi]


def _strictest_first(rows: Iterable[int], wanted: Sequence[Wanted]) -> list[int]:
    """In an order in which no limits come before stricter ones."""

    def key(at: int) -> tuple[float, ...]:
        each = wanted[at]
        return -each.disk_margin, each.noise, each.peak or np.inf, -each.delay_margin, each.slowest_s

    return sorted(rows, key=key)

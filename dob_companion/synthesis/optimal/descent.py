"""Poles moved to where the best numerator is best: descent on the programme's value, and growth of the order."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from dob_companion.synthesis.optimal.poles import free, roots
from dob_companion.synthesis.optimal.programme import Programme, Solved

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

STEPS, ENOUGH = 40, 3e-5
"""Steps of a descent at most, and the share of the value below which two in a row are too little to go on."""

LONGEST = 1.0
"""Step at most, in free numbers."""

FIRST_TRUST, LEAST_TRUST = 0.3, 2e-3

STARTS = ((0.1, 0.75), (0.05, 1.0))
"""Real poles to begin with: the least and the greatest of their angles, rad per sample (4 and 30 Hz at 250 Hz)."""

REAL = (0.95, 0.85, 0.7, 0.5, 0.2, -0.3)
PAIRS = tuple((r, f) for r in (0.9, 0.75, 0.5) for f in (0.05, 0.12, 0.25, 0.5))
REAL_PAIRS = ((0.9, 0.5), (0.7, -0.2))
"""Poles to add, on trial: real ones, and pairs of radius and angle / pi, and real pairs."""

FOLLOWED = 2
"""Of these the best are followed."""


def descend(programme: Programme, x: Array, begun: Solved | None = None) -> Solved | None:
    """By a sequence of convex programmes within a trust region; None where x has no answer. `begun`: known for x."""
    if begun is not None:
        programme.resume(begun)
    best, trust, small = programme.solve(x), FIRST_TRUST, 0
    if best is None:
        return None
    for _ in range(STEPS):
        to = programme.step(best, trust)
        programme.resume(best)
        found = programme.solve(to) if to is not None else None
        if found is None or found.value >= best.value:
            trust /= 4.0
            if trust < LEAST_TRUST:
                break
            continue
        small = small + 1 if best.value - found.value <= ENOUGH * best.value else 0
        best, trust = found, min(2.0 * trust, LONGEST)
        if small >= 2:
            break
    return best


def started(programme: Programme, order: int) -> Solved | None:
    """The best descent of `order` poles from generic ones; None where nothing keeps the limits."""
    found = [descend(programme, free(_generic(places, order), programme.radius)) for places in STARTS]
    return min((each for each in found if each), key=lambda each: each.value, default=None)


def _generic(places: tuple[float, float], order: int) -> Complex:
    """Real poles, even on a logarithmic scale of frequency."""
    return np.exp(-np.geomspace(*places, order)).astype(complex)


def grown(programme: Programme, solved: Solved, most: int) -> Solved | None:
    """The best with one or two more poles, at most `most` in all; None where there is none."""
    poles = roots(solved.x, programme.radius)
    tried = []
    for added in _added(most - len(poles)):
        programme.resume(solved)
        found = programme.solve(free(np.concatenate([poles, added]), programme.radius))
        if found:
            tried.append(found)
    tried.sort(key=lambda found: found.value)
    ends = [descend(programme, found.x, found) for found in tried[:FOLLOWED]]
    return min((each for each in ends if each), key=lambda each: each.value, default=None)


def _added(room: int) -> Iterator[Complex]:
    if room == 1:
        yield from (np.array([p], complex) for p in REAL)
    if room == 2:
        yield from (np.asarray(r * np.exp(np.array([1j, -1j]) * np.pi * f), dtype=complex) for r, f in PAIRS)
        yield from (np.array(pair, complex) for pair in REAL_PAIRS)

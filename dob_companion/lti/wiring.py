"""Block diagrams by the names of their signals: sums of signals go into parts, parts give signals. numpy only."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from dob_companion.lti.statespace import ABCD, System, beside, wired

Array = NDArray[np.float64]
Sums = Mapping[str, Mapping[str, float]]
"""Name of a sum -> signal -> factor with which it counts, component by component."""


def connected(
    parts: Sequence[System],
    *,
    into: Sums,
    give: Sequence[str],
    outside: Sequence[str],
    read: Sums,
    size: Mapping[str, int],
) -> ABCD:
    """The system from the signals `outside` to the sums `read`.

    into   what goes into the parts, in the order of their inputs
    give   the signals that the parts give, in the order of their outputs
    size   how many components each signal and each sum has

    Raises numpy.linalg.LinAlgError for an algebraic loop without solution, KeyError for a signal that nothing gives.
    """
    unknown = {name for sums in (into, read) for terms in sums.values() for name in terms} - {*give, *outside}
    if unknown:
        raise KeyError(f"no part gives {', '.join(sorted(unknown))}")
    inside, from_outside = _factors(into, give, size), _factors(into, outside, size)
    return wired(beside(*parts), inside, from_outside, _factors(read, give, size), _factors(read, outside, size))


def spans(names: Iterable[str], size: Mapping[str, int]) -> dict[str, slice]:
    """Where each signal has its components when they stand one behind the other."""
    found, first = {}, 0
    for name in names:
        found[name] = slice(first, first + size[name])
        first += size[name]
    return found


def _factors(sums: Sums, signals: Sequence[str], size: Mapping[str, int]) -> Array:
    """The sums as a matrix over these signals; terms of others are left out."""
    rows, columns = spans(sums, size), spans(signals, size)
    M = np.zeros((sum(map(size.__getitem__, sums)), sum(map(size.__getitem__, signals))))
    for name, terms in sums.items():
        for signal, factor in terms.items():
            if signal in columns:
                M[rows[name], columns[signal]] = factor * np.eye(size[name])
    return M

"""The closed loop as it flies: vehicle, baseline controller, link delay and observer, wired by signal names.

::

                          w_r            ┌─────────────────────────────┐ u_e
                           ▼             │             d               │
    y_n ─►(-)─► C ─► u ─►(+)─►(-)────────┴─► (unseen) ─▼─► G ─► y ─►(+)┴─► D(z) ─► d_hat
                               ▲                                     ▲ n            │
                               └───────────────── z^-tau ◄───────────┴──────────────┘

u = C (r - y_n) with r = 0, u_e = u - z^-tau d_hat + w_r, y = G (u_e + d), y_n = y + n.
"""

from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.lti.statespace import beside, delay_line, wired

Array = NDArray[np.float64]

# Each part's input is a sum of part outputs and outside signals.
_SUMS = {
    "moment": (("u", 1), ("acting", -1), ("d", 1), ("w_r", 1)),  # into G
    "measured": (("y", -1), ("n", -1)),  # into C
    "y_n": (("y", 1), ("n", 1)),  # into D(z), first
    "reported": (("u", 1), ("late", -1), ("w_r", 1)),  # into D(z), second: u_e
    "estimate": (("d_hat", 1),),  # into z^-tau
    "believed": (("late", 1),),  # into the delay nobody knows of
}
# What is read out, likewise.
_READ = {
    "y": (("y", 1),),
    "u_e": (("u", 1), ("late", -1), ("w_r", 1)),
    "d_hat": (("d_hat", 1),),
    "error": (("d", 1), ("late", -1)),  # d - z^-tau d_hat
}
_OUTSIDE = ("d", "n", "w_r")


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """All closed-loop transfer functions at once, (d, n, w_r) -> (y, u_e, d_hat, error); p rates, m moments."""

    system: Any
    p: int
    m: int

    def part(self, output: str, *inputs: str) -> Any:
        """The system from the named inputs to one named output."""
        size = _sizes(self.p, self.m)
        rows, columns = _spans(_READ, size), _spans(_OUTSIDE, size)
        return self.system[rows[output], [k for name in inputs for k in columns[name]]]


def close_loop(
    plant: Any, controller: Any, observer: Any, delays: tuple[int, ...], unseen_delay: tuple[int, ...] | None = None
) -> Loop:
    """Wire the loop.

    `observer` None leaves it off. `unseen_delay` puts further samples of delay between the correction
    and the moment that the observer is not told about: it goes on believing u_e = u - z^-tau d_hat.
    """
    p, m = plant.D.shape
    dt = plant.dt
    off = ct.ss([], [], [], np.zeros((m, p + m)), dt)
    parts = (plant, controller, observer or off, *map(delay_line, delays), *map(delay_line, unseen_delay or (0,) * m))
    size = _sizes(p, m)
    outputs = ("y", "u", "d_hat", "late", "acting")
    inside, outside = _matrix(_SUMS, outputs, size), _matrix(_SUMS, _OUTSIDE, size)
    read, past = _matrix(_READ, outputs, size), _matrix(_READ, _OUTSIDE, size)
    return Loop(ct.ss(*wired(beside(*parts), inside, outside, read, past), dt), p, m)


def _sizes(p: int, m: int) -> dict[str, int]:
    rates = ("y", "n", "y_n", "measured")
    return {name: p if name in rates else m for name in (*_SUMS, *_READ, *_OUTSIDE, "u", "late", "acting")}


def _spans(names: Any, size: dict[str, int]) -> dict[str, list[int]]:
    spans, first = {}, 0
    for name in names:
        spans[name] = list(range(first, first + size[name]))
        first += size[name]
    return spans


def _matrix(sums: dict[str, tuple[tuple[str, int], ...]], sources: tuple[str, ...], size: dict[str, int]) -> Array:
    """The rows of `sums` over the signals `sources`; terms from elsewhere are left out."""
    rows, columns = _spans(sums, size), _spans(sources, size)
    M = np.zeros((sum(size[name] for name in sums), sum(size[name] for name in sources)))
    for target, terms in sums.items():
        for name, sign in terms:
            if name in columns:
                M[rows[target], columns[name]] = sign  # signal by signal: the diagonal of that patch
    return M

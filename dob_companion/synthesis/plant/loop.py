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

from dob_companion.lti.statespace import delay_line
from dob_companion.lti.wiring import connected, spans

_INTO = {
    "moment": {"u": 1.0, "acting": -1.0, "d": 1.0, "w_r": 1.0},  # into G
    "measured": {"y": -1.0, "n": -1.0},  # into C
    "y_n": {"y": 1.0, "n": 1.0},  # into D(z), first
    "u_e": {"u": 1.0, "late": -1.0, "w_r": 1.0},  # into D(z), second
    "estimate": {"d_hat": 1.0},  # into z^-tau
    "believed": {"late": 1.0},  # into the delay nobody knows of
}
_READ = {
    "y": {"y": 1.0},
    "u_e": _INTO["u_e"],
    "d_hat": {"d_hat": 1.0},
    "error": {"d": 1.0, "late": -1.0},  # d - z^-tau d_hat
}
_GIVE = ("y", "u", "d_hat", "late", "acting")
_OUTSIDE = ("d", "n", "w_r")
_RATES = ("y", "n", "y_n", "measured")


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """All closed-loop transfer functions at once, (d, n, w_r) -> (y, u_e, d_hat, error); p rates, m moments."""

    system: Any
    p: int
    m: int

    def part(self, output: str, *inputs: str) -> Any:
        """The system from the named inputs to one named output."""
        size = _sizes(self.p, self.m)
        rows, columns = spans(_READ, size), spans(_OUTSIDE, size)
        return self.system[_list(rows[output]), [k for name in inputs for k in _list(columns[name])]]


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
    whole = connected(parts, into=_INTO, give=_GIVE, outside=_OUTSIDE, read=_READ, size=_sizes(p, m))
    return Loop(ct.ss(*whole, dt), p, m)


def _sizes(p: int, m: int) -> dict[str, int]:
    return {name: p if name in _RATES else m for name in (*_INTO, *_READ, *_GIVE, *_OUTSIDE)}


def _list(span: slice) -> list[int]:
    return list(range(span.start, span.stop))

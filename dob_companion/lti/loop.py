"""A vehicle with its observer, driven by the disturbance and noise that a design was made for. numpy only."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dob_companion.lti.statespace import ABCD, System, beside, delay_line
from dob_companion.lti.wiring import connected, spans

Array = NDArray[np.float64]

_INTO = {
    "moment": {"u": 1.0, "late": -1.0, "d": 1.0},  # into G
    "measured": {"y": -1.0, "n": -1.0},  # into C
    "y_n": {"y": 1.0, "n": 1.0},  # into the observer, first
    "u_e": {"u": 1.0, "late": -1.0},  # into the observer, second
    "estimate": {"d_hat": 1.0},  # into z^-delay
    "w_d": {"white_d": 1.0},
    "w_n": {"white_n": 1.0},
}
_READ = {
    "y_n": {"y": 1.0, "n": 1.0},
    "u_e": {"u": 1.0, "late": -1.0},
    "d_hat": {"d_hat": 1.0},
    "error": {"d": 1.0, "late": -1.0},
}


class WeightedLoop(NamedTuple):
    """x+ = A x + B w with w = [w_d; w_n] white of unit covariance, and (C, D) of what is read out of it."""

    A: Array
    B: Array
    y_n: tuple[Array, Array]
    u_e: tuple[Array, Array]
    d_hat: tuple[Array, Array]
    error: tuple[Array, Array]
    """d - z^-delay d_hat"""


def weighted_loop(
    plant: System, controller: System, observer: System, w_d: System, w_n: System, delay: int
) -> WeightedLoop:
    """Wire u = C (-y_n), u_e = u - z^-delay d_hat, y_n = G (u_e + d) + n, d = W_d w_d, n = W_n w_n.

    Shapes: G p x m, C m x p, observer m x (p + m). Raises numpy.linalg.LinAlgError for a loop that is not well posed.
    """
    p, m = plant.D.shape
    size = dict.fromkeys(("moment", "u", "u_e", "late", "estimate", "d_hat", "d", "error"), m)
    size |= dict.fromkeys(("measured", "y", "y_n", "n"), p)
    size |= {
        name: weight.D.shape[1]
        for names, weight in ((("w_d", "white_d"), w_d), (("w_n", "white_n"), w_n))
        for name in names
    }
    whole = connected(
        (plant, controller, observer, beside(*[delay_line(delay)] * m), w_d, w_n),
        into=_INTO,
        give=("y", "u", "d_hat", "late", "d", "n"),
        outside=("white_d", "white_n"),
        read=_READ,
        size=size,
    )
    return WeightedLoop(whole.A, whole.B, *(_rows(whole, rows) for rows in spans(_READ, size).values()))


def _rows(system: ABCD, rows: slice) -> tuple[Array, Array]:
    return system.C[rows], system.D[rows]

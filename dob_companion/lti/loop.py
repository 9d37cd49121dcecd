"""A vehicle with its observer, driven by the disturbance and noise that a design was made for. numpy only."""

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dob_companion.lti.statespace import ABCD, System, beside, delay_line, wired

Array = NDArray[np.float64]


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
    late = beside(*[delay_line(delay)] * m)
    parts = beside(plant, controller, observer, late, w_d, w_n)
    y, u, d_hat, late_d_hat, d, n = _spans([p, m, m, m, m, p])
    into_plant, into_controller, into_y, into_u, into_late, from_outside = _spans(
        [m, p, p, m, m, w_d.D.shape[1] + w_n.D.shape[1]]
    )
    inside, outside = np.zeros(parts.D.T.shape), np.zeros((parts.D.shape[1], from_outside.stop - from_outside.start))
    for rows, column, sign in (
        (into_plant, u, 1.0),
        (into_plant, late_d_hat, -1.0),
        (into_plant, d, 1.0),
        (into_controller, y, -1.0),
        (into_controller, n, -1.0),
        (into_y, y, 1.0),
        (into_y, n, 1.0),
        (into_u, u, 1.0),
        (into_u, late_d_hat, -1.0),
        (into_late, d_hat, 1.0),
    ):
        _add(inside, rows, column, sign)
    outside[from_outside] = np.eye(outside.shape[1])
    read = np.zeros((p + 3 * m, len(parts.D)))
    outputs = _spans([p, m, m, m])
    for rows, column, sign in zip(
        [outputs[k] for k in (0, 0, 1, 1, 2, 3, 3)],
        [y, n, u, late_d_hat, d_hat, d, late_d_hat],
        [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0],
        strict=True,
    ):
        _add(read, rows, column, sign)
    whole = wired(parts, inside, outside, read, np.zeros((len(read), outside.shape[1])))
    return WeightedLoop(whole.A, whole.B, *(_rows(whole, rows) for rows in outputs))


def _rows(system: ABCD, rows: slice) -> tuple[Array, Array]:
    return system.C[rows], system.D[rows]


def _add(matrix: Array, rows: slice, columns: slice, sign: float) -> None:
    matrix[rows, columns] += sign * np.eye(rows.stop - rows.start)


def _spans(sizes: Sequence[int]) -> list[slice]:
    return [slice(end - size, end) for size, end in zip(sizes, accumulate(sizes), strict=True)]

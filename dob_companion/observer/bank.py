"""The observer as it flies: every block of a design stacked into one, stepped once per gyro sample. numpy only."""

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import AXES, DobDesign
from dob_companion.lti.statespace import powers

Vector = NDArray[np.float64]
Axes3 = tuple[float, float, float]
_Step = tuple[tuple[Axes3, Axes3], Vector, Axes3]
"""The inputs of a step, and x and C x after it."""


class ObserverBank:
    """d_hat(k) = C x(k) + D_y y_n(k);  x(k+1) = A x(k) + B [y_n(k); u_e(k)].

    Three values each: roll, pitch, yaw in hover axes; rates in rad/s, moments in normalized torque.
    An axis that no block covers estimates exactly zero. D's columns for u_e are zero (`check_flyable`), so the
    answer to y_n(k) needs no u_e(k): the two halves of a step are two methods. The large half, x(k+1) and C x(k+1),
    may be worked out as soon as u_e(k) is known (`foresee`); what is left to an answer is D_y y_n.
    """

    __slots__ = ("_A", "_B", "_C", "_Cx", "_D_y", "_foreseen", "_late", "_x", "covered")

    def __init__(self, design: DobDesign, *, revisable: int = 0) -> None:
        """`revisable`: so many steps may be revised, see `revise`."""
        order = sum(block.observer.order for block in design.blocks)
        self._A, self._B = np.zeros((order, order)), np.zeros((order, 6))
        self._C, D_y = np.zeros((3, order)), np.zeros((3, 3))
        at = 0
        for block in design.blocks:
            rows = [AXES.index(axis) for axis in block.axes]
            columns = rows + [3 + row for row in rows]
            states = slice(at, at + block.observer.order)
            at = states.stop
            self._A[states, states] = block.observer.A
            self._B[states, columns] = block.observer.B
            self._C[rows, states] = block.observer.C
            D_y[np.ix_(rows, rows)] = block.observer.D[:, : len(rows)]
        covered = {axis for block in design.blocks for axis in block.axes}
        self.covered: tuple[bool, ...] = tuple(axis in covered for axis in AXES)
        self._D_y: list[list[float]] = D_y.tolist()
        self._x: Vector = np.zeros(order)
        self._Cx: Axes3 = (0.0, 0.0, 0.0)
        self._foreseen: _Step | None = None
        self._late = powers(self._A, self._B, revisable)

    def estimate(self, y_n: Axes3) -> Axes3:
        """d_hat of the sample whose gyro rates are `y_n`; the state stays."""
        (roll, pitch, yaw), (p, q, r) = self._Cx, y_n
        (rp, rq, rr), (pp, pq, pr), (yp, yq, yr) = self._D_y
        return roll + rp * p + rq * q + rr * r, pitch + pp * p + pq * q + pr * r, yaw + yp * p + yq * q + yr * r

    def advance(self, y_n: Axes3, u_e: Axes3) -> None:
        """Finish the sample: `y_n` its gyro rates, `u_e` the moment that was really applied from it on."""
        step = self._foreseen
        if step is None or step[0] != (y_n, u_e):
            step = self._step(y_n, u_e)
        _, self._x, self._Cx = step
        self._foreseen = None

    def foresee(self, y_n: Axes3, u_e: Axes3) -> None:
        """Work out ahead what `advance` with these inputs does. With others it works that out anew."""
        self._foreseen = self._step(y_n, u_e)

    def revise(self, ago: int, y_n: Axes3, u_e: Axes3) -> None:
        """The inputs of a step already finished were off by `y_n` (rad/s) and `u_e` (normalized torque): put it right.

        `ago` counts the steps finished since: 0 is the last. The state is what it would be, had they been known.
        """
        self._x = self._x + self._late[ago] @ np.array((*y_n, *u_e))
        roll, pitch, yaw = (self._C @ self._x).tolist()
        self._Cx, self._foreseen = (roll, pitch, yaw), None

    def reset(self) -> None:
        """Forget everything: the zero state."""
        self._x, self._Cx, self._foreseen = np.zeros(len(self._x)), (0.0, 0.0, 0.0), None

    def _step(self, y_n: Axes3, u_e: Axes3) -> _Step:
        x = self._A @ self._x + self._B @ np.array((*y_n, *u_e))
        roll, pitch, yaw = (self._C @ x).tolist()
        return (y_n, u_e), x, (roll, pitch, yaw)

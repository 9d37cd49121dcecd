"""The observer as it flies: every block of a design stacked into one, stepped once per gyro sample. numpy only."""

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import AXES, DobDesign

Vector = NDArray[np.float64]


class ObserverBank:
    """d_hat(k) = C x(k) + D_y y_n(k);  x(k+1) = A x(k) + B [y_n(k); u_e(k)].

    Vectors have shape (3,): roll, pitch, yaw in hover axes; rates in rad/s, moments in normalized torque.
    An axis that no block covers estimates exactly zero. D's columns for u_e are zero (`check_flyable`), so the
    answer to y_n(k) needs no u_e(k): the two halves of a step are two methods.
    """

    __slots__ = ("_A", "_B", "_C", "_D_y", "_inputs", "_next", "_x", "covered")

    def __init__(self, design: DobDesign) -> None:
        order = sum(block.observer.order for block in design.blocks)
        self._A, self._B = np.zeros((order, order)), np.zeros((order, 6))
        self._C, self._D_y = np.zeros((3, order)), np.zeros((3, 3))
        at = 0
        for block in design.blocks:
            rows = [AXES.index(axis) for axis in block.axes]
            columns = rows + [3 + row for row in rows]
            states = slice(at, at + block.observer.order)
            at = states.stop
            self._A[states, states] = block.observer.A
            self._B[states, columns] = block.observer.B
            self._C[rows, states] = block.observer.C
            self._D_y[np.ix_(rows, rows)] = block.observer.D[:, : len(rows)]
        covered = {axis for block in design.blocks for axis in block.axes}
        self.covered: tuple[bool, ...] = tuple(axis in covered for axis in AXES)
        self._x, self._next, self._inputs = np.zeros(order), np.zeros(order), np.zeros(6)

    def estimate(self, y_n: Vector) -> Vector:
        """d_hat of the sample whose gyro rates are `y_n`; the state stays."""
        estimate: Vector = self._C @ self._x + self._D_y @ y_n
        return estimate

    def advance(self, y_n: Vector, u_e: Vector) -> None:
        """Finish the sample: `y_n` its gyro rates, `u_e` the moment that was really applied from it on."""
        self._inputs[:3], self._inputs[3:] = y_n, u_e
        np.dot(self._A, self._x, out=self._next)
        self._next += self._B @ self._inputs
        self._x, self._next = self._next, self._x

    def reset(self) -> None:
        """Forget everything: the zero state."""
        self._x[:] = 0.0

"""The design's own model of what the gyro shows, kept in step with it, so that missing samples can be put in."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import AXES, DobDesign
from dob_companion.lti.predictor import Predictor
from dob_companion.lti.statespace import powers

Vector = NDArray[np.float64]
Axes3 = tuple[float, float, float]


predictor_of = lru_cache(maxsize=16)(Predictor.of)
"""Of frozen matrices: found once for a design, however often a flight begins with it."""


class GyroModel:
    """One-step predictors of all blocks, stacked: x_hat of plant, coloured disturbance and coloured noise.

    Rates in rad/s, moments in normalized torque, hover axes. An axis that no block covers is bridged by a line.
    """

    __slots__ = ("_A", "_B", "_C", "_D", "_K", "_bridges", "_late", "_line", "_x")

    def __init__(self, design: DobDesign, *, longest: int, revisable: int = 0, noise_scale: float = 1.0) -> None:
        """`longest`: samples in a row that may be put in; `revisable`: so many steps may be revised; `noise_scale`: of
        the design's noise weights (`lti.predictor`)."""
        predictors = [(predictor_of(block.problem, noise_scale), block) for block in design.blocks]
        order = sum(len(predictor.A) for predictor, _ in predictors)
        self._A, self._B, self._K = np.zeros((order, order)), np.zeros((order, 3)), np.zeros((order, 3))
        self._C, self._D = np.zeros((3, order)), np.zeros((3, 3))
        self._line = np.ones(3, dtype=bool)
        self._bridges = [np.zeros((steps, 3, 3)) for steps in range(longest + 2)]
        at = 0
        for predictor, block in predictors:
            rows = [AXES.index(axis) for axis in block.axes]
            states = slice(at, at + len(predictor.A))
            at = states.stop
            self._A[states, states] = predictor.A
            self._B[states, rows], self._K[states, rows] = predictor.B, predictor.K
            self._C[rows, states], self._D[np.ix_(rows, rows)] = predictor.C, predictor.D
            self._line[rows] = False
            for whole, own in zip(self._bridges, predictor.bridging(longest + 1), strict=True):
                whole[np.ix_(range(len(own)), rows, rows)] = own
        self._x: Vector = np.zeros(order)
        self._late = powers(self._A - self._K @ self._C, np.hstack([self._K, self._B - self._K @ self._D]), revisable)

    def advance(self, y_n: Axes3, u_e: Axes3) -> Axes3:
        """Finish a sample, as the observer does. Returns the innovation, what was not foreseen of `y_n`, in rad/s; 0 on
        an axis that no block covers."""
        moment = np.array(u_e)
        innovation = np.where(self._line, 0.0, np.array(y_n) - self._C @ self._x - self._D @ moment)
        self._x = self._A @ self._x + self._B @ moment + self._K @ innovation
        roll, pitch, yaw = innovation.tolist()
        return roll, pitch, yaw

    def revise(self, ago: int, y_n: Axes3, u_e: Axes3) -> None:
        """As `ObserverBank.revise`."""
        self._x = self._x + self._late[ago] @ np.array((*y_n, *u_e))

    def reset(self) -> None:
        """Forget everything: the zero state."""
        self._x = np.zeros(len(self._x))

    def bridge(self, first: Axes3, moments: Sequence[Axes3], last: Axes3, beyond: float = 0.0) -> list[Axes3]:
        """The rates between two samples that others are missing between: what the model expects, given both.

        `first`: the rates at the begin of the first interval; `moments`: those of the intervals, at least one; `last`:
        the rates `beyond` (0…1) intervals after the last of them. Returns the rates at the end of each interval.
        """
        steps = len(moments)
        y_first, y_last = np.array(first), np.array(last)
        foreseen = self._foreseen(y_first, np.array(moments))
        surprise = y_last - (1.0 - beyond) * foreseen[steps - 1] - beyond * foreseen[steps]
        nearest = steps + (beyond > 0.5)
        rates = foreseen[:steps] + self._bridges[nearest][:steps] @ surprise
        share = np.arange(1, steps + 1)[:, None] / (steps + beyond)
        rates[:, self._line] = ((1.0 - share) * y_first + share * y_last)[:, self._line]
        if beyond == 0.0:
            rates[-1] = y_last
        return [(roll, pitch, yaw) for roll, pitch, yaw in rates.tolist()]

    def expect(self, finished: Sequence[tuple[Axes3, Axes3]], moment: Axes3) -> Axes3:
        """The rates after further intervals, (rates, moment) each, under a moment."""
        x = self._x
        for y_n, u_e in finished:
            x = self._next(x, np.array(y_n), np.array(u_e))
        roll, pitch, yaw = (self._C @ x + self._D @ np.array(moment)).tolist()
        return roll, pitch, yaw

    def _foreseen(self, y_first: Vector, moments: Vector) -> Vector:
        """The rates that the model expects at the end of each interval, and of one more with the last moment held."""
        foreseen = np.empty((len(moments) + 1, 3))
        x = self._next(self._x, y_first, moments[0])
        for k, moment in enumerate([*moments[1:], moments[-1], moments[-1]]):
            foreseen[k] = self._C @ x + self._D @ moment
            x = self._A @ x + self._B @ moment
        return foreseen

    def _next(self, x: Vector, y_n: Vector, u_e: Vector) -> Vector:
        return np.asarray(self._A @ x + self._B @ u_e + self._K @ (y_n - self._C @ x - self._D @ u_e))

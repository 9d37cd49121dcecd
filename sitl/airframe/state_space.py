"""Linear axes of any order as matrices: what somebody's own aircraft is to the simulation."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sitl.airframe.linear import RateAxis
from sitl.attitude import Vector
from sitl.errors import FlightFailedError

Array = NDArray[np.float64]

TUMBLING = 500.0
"""Body rate, rad/s, beyond which there is nothing left to simulate: eighty turns a second."""


class StateSpace(NamedTuple):
    """x(k+1) = A x + B u, y = C x + D u: A (n, n), B (n, m), C (p, n), D (p, m), discrete at `DT`."""

    A: Array
    B: Array
    C: Array
    D: Array

    @classmethod
    def of(cls, axis: RateAxis) -> "StateSpace":
        """A `RateAxis` in the form that `LinearAxis` steps: one input, one output, two states."""
        b1, b2 = axis.gain, -axis.gain * axis.zero
        A = np.array([[axis.slow + axis.pole, 1.0], [-axis.slow * axis.pole, 0.0]])
        return cls(A, np.array([[b1], [b2]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)))


class CoupledRates:
    """Three rates of one linear system without feedthrough, roll, pitch, yaw; see `RateDynamics`."""

    def __init__(self, plant: StateSpace) -> None:
        self._whole = np.vstack([np.hstack([plant.A, plant.B]), np.hstack([plant.C @ plant.A, plant.C @ plant.B])])
        self._n = len(plant.A)
        self._inputs = np.zeros(self._n + 3)

    def advance(self, moment: Vector) -> Vector:
        """Apply `moment` for one sample; returns the new rates, rad/s. Raises FlightFailedError when they run away."""
        n = self._n
        self._inputs[n:] = moment
        ahead = self._whole @ self._inputs
        self._inputs[:n] = ahead[:n]
        roll, pitch, yaw = ahead[n:].tolist()
        if not max(abs(roll), abs(pitch), abs(yaw)) <= TUMBLING:  # also what is not a number
            raise FlightFailedError("the vehicle tumbles: its own rate loop does not hold it")
        return roll, pitch, yaw

    def reset(self) -> None:
        """Stand still."""
        self._inputs[:] = 0.0


def beside(parts: list[tuple[tuple[int, ...], StateSpace]]) -> StateSpace:
    """Square systems over different ones of the three axes as one from three inputs to three outputs."""
    n = sum(len(part.A) for _, part in parts)
    A, B, C, D = np.zeros((n, n)), np.zeros((n, 3)), np.zeros((3, n)), np.zeros((3, 3))
    first = 0
    for axes, part in parts:
        states, where = slice(first, first + len(part.A)), np.ix_(axes, axes)
        A[states, states], B[states, axes], C[axes, states], D[where] = part.A, part.B, part.C, part.D
        first = states.stop
    return StateSpace(A, B, C, D)

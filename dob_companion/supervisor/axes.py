"""The sign and axis check: do measured rate and reported moment belong together as the design thinks?

An axis that is inverted, swapped or in other units turns the observer against the aircraft. In closed loop, without
deliberate excitation, moment and rate are tied by the autopilot's own controller: u = C (r - y_n), and between about 3
and 30 Hz the pilot's r says little. So the rate that the plant model predicts from the *reported* moment, G u, must
agree with the one that it predicts from what the design's controller would ask, given the *measured* rate,
-G C y_n. Both go through the same band-pass; their correlation and slope over the last seconds decide:

* correlation near -1: inverted. Slope far from 1: badly scaled (rates in deg/s, moments in N m).
* little correlation with its own axis, much with another's: swapped.
* too little motion, or neither nor: unproven, which is said but forbids nothing. A controller that differs from the
  design's (filters, limits) lowers the correlation, not its sign.

It cannot see an error that moment and rate share, nor the true gain of the plant.
"""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import AXES, DobDesign, StateSpaceData

Vector = NDArray[np.float64]

BAND_HZ = (3.0, 30.0)
WINDOW_S = 2.0
"""Memory of the correlations."""

PROOF = 0.7
"""Magnitude of a correlation that counts as proof, of an agreement or of an error."""

LARGEST_SCALE = 3.0
"""Slope, or its inverse, up to which units count as right: autopilots differ from the design's controller."""

LEAST_MOTION = 1e-6
"""Root mean square of a predicted rate, rad/s, below which an axis says nothing."""


class AxisCheck:
    """Watches [u; y_n] of all axes; `errors` names the axes with proof of an error, `unproven` those without any."""

    def __init__(self, design: DobDesign) -> None:
        self._dt = design.dt
        self._covered = sorted(AXES.index(axis) for block in design.blocks for axis in block.axes)
        self._model = _comparison(design)
        self._forget = math.exp(-design.dt / WINDOW_S)
        self.clear()

    def clear(self) -> None:
        """Forget everything, as after a gap."""
        self._x = np.zeros(self._model.order)
        self._products = np.zeros((6, 6))
        self._samples = 0

    def add(self, y_n: Iterable[float], u: Iterable[float]) -> None:
        """One sample: rates (rad/s) and the controller's own moment, correction excluded (normalized torque)."""
        inputs = np.array((*u, *y_n))
        pair = self._model.C @ self._x + self._model.D @ inputs
        self._x = self._model.A @ self._x + self._model.B @ inputs
        self._products *= self._forget
        self._products += pair[:, None] * pair
        self._samples += 1

    @property
    def ready(self) -> bool:
        """Whether a full window has been seen."""
        return self._samples * self._dt >= WINDOW_S

    def errors(self) -> list[str]:
        """What is proved wrong, an axis each, in words; empty when nothing is."""
        return [words for i in self._covered if (words := self._error(i))] if self.ready else []

    def unproven(self) -> list[str]:
        """Axes whose agreement is not proved either."""
        return [AXES[i] for i in self._covered if not self.ready or self._correlation(i, i) < PROOF]

    def _error(self, i: int) -> str:
        own = self._correlation(i, i)
        if own <= -PROOF:
            return f"{AXES[i]} is inverted"
        others = [j for j in self._covered if j != i and abs(self._correlation(i, j)) >= PROOF]
        if abs(own) < PROOF and others:
            return f"{AXES[i]} is swapped with {AXES[others[0]]}"
        if own >= PROOF:
            slope = float(self._products[i, 3 + i] / self._products[3 + i, 3 + i])
            if not 1.0 / LARGEST_SCALE <= slope <= LARGEST_SCALE:
                return f"{AXES[i]} is scaled by {slope:.3g}"
        return ""

    def _correlation(self, i: int, j: int) -> float:
        """Of the rate predicted from the moment of axis i with the one asked for by the rate of axis j."""
        power_i, power_j = self._products[i, i], self._products[3 + j, 3 + j]
        if min(power_i, power_j) < LEAST_MOTION**2 * WINDOW_S / self._dt:
            return 0.0
        return float(self._products[i, 3 + j] / math.sqrt(power_i * power_j))


def _comparison(design: DobDesign) -> StateSpaceData:
    """[u; y_n] -> [H G u; -H G C y_n] over the three axes, H the band-pass; zero on axes that no block covers."""
    predicted, asked = (_spread_blocks(design, with_controller=choice) for choice in (False, True))
    both = _beside(predicted, asked)
    high, low = (_butterworth(design.dt, cutoff, cutoff == BAND_HZ[0]) for cutoff in BAND_HZ)
    return _series(both, _series(_repeated(low, 6), _repeated(high, 6)))


def _spread_blocks(design: DobDesign, with_controller: bool) -> StateSpaceData:
    """G, or -G C, of all blocks as one 3x3 system in axis order."""
    total = StateSpaceData([], [], [], np.zeros((3, 3)))
    for block in design.blocks:
        rows = [AXES.index(axis) for axis in block.axes]
        model = block.problem.plant
        if with_controller:
            model = _series(model, block.problem.controller)
            model = StateSpaceData(model.A, model.B, -model.C, -model.D)
        select = np.eye(3)[rows]
        model = StateSpaceData(model.A, model.B @ select, select.T @ model.C, select.T @ model.D @ select)
        total = _sum(total, model)
    return total


def _series(second: StateSpaceData, first: StateSpaceData) -> StateSpaceData:
    """y = second(first(u))."""
    n, m = second.order, first.order
    A = np.block([[second.A, second.B @ first.C], [np.zeros((m, n)), first.A]])
    return StateSpaceData(
        A, np.vstack([second.B @ first.D, first.B]), np.hstack([second.C, second.D @ first.C]), second.D @ first.D
    )


def _sum(a: StateSpaceData, b: StateSpaceData) -> StateSpaceData:
    """y = a(u) + b(u)."""
    return StateSpaceData(_diagonal(a.A, b.A), np.vstack([a.B, b.B]), np.hstack([a.C, b.C]), a.D + b.D)


def _beside(a: StateSpaceData, b: StateSpaceData) -> StateSpaceData:
    """[y_a; y_b] = [a(u_a); b(u_b)]."""
    return StateSpaceData(*(_diagonal(x, y) for x, y in ((a.A, b.A), (a.B, b.B), (a.C, b.C), (a.D, b.D))))


def _repeated(model: StateSpaceData, channels: int) -> StateSpaceData:
    eye = np.eye(channels)
    return StateSpaceData(*(np.kron(eye, m) for m in (model.A, model.B, model.C, model.D)))


def _diagonal(a: Vector, b: Vector) -> Vector:
    return np.block([[a, np.zeros((a.shape[0], b.shape[1]))], [np.zeros((b.shape[0], a.shape[1])), b]])


def _butterworth(dt: float, cutoff_hz: float, high: bool) -> StateSpaceData:
    """Second-order Butterworth high-pass or low-pass (bilinear transform, cutoff prewarped)."""
    k = math.tan(math.pi * cutoff_hz * dt)
    norm = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    a1, a2 = 2.0 * (k * k - 1.0) * norm, (1.0 - math.sqrt(2.0) * k + k * k) * norm
    b0 = norm if high else k * k * norm
    b1, b2 = (-2.0 * b0 if high else 2.0 * b0), b0
    return StateSpaceData([[-a1, 1.0], [-a2, 0.0]], [[b1 - a1 * b0], [b2 - a2 * b0]], [[1.0, 0.0]], [[b0]])

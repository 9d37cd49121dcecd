"""The sign and axis check: do measured rate and reported moment belong together as the design thinks?

An axis that is inverted, swapped or in other units turns the observer against the aircraft. In closed loop, without
deliberate excitation, moment and rate are tied by the autopilot's own controller: u = C (r - y_n). So the rate a that
the plant model predicts from the *reported* moment, G u, must agree with the one b that it predicts from what the
design's controller would ask for, given the *measured* rate, -G C y_n; both through one band-pass, 3 to 30 Hz.

What r says in that band spoils the agreement, and comes in two kinds. The attitude loop asks for r = -k times the
integral of the rate, whatever its gain k: the part of a and b that the running sum of b explains is taken out of both
(partial correlation). A pilot, a position hold that leans or a gust that it answers ask for what nobody here knows:
then the vehicle turns as it is told, u is small beside C y_n, and a and b may agree or oppose each other for a second
or two.

Hence the persistence. Each half second gives one correlation between every a and b, however strong its motion was,
and the last six must agree, so that a burst counts as one of six:

* inverted: on average -0.6 or below, at a slope that is right but for its sign.
* badly scaled (rates in deg/s, moments in N m): each of them 0.6 or above, and all slopes a/b wrong alike. Motion
  that is commanded has any slope, units have one.
* swapped: on average little with its own axis, 0.6 or more with another's, and the same for that one.
* too little motion, or neither nor: unproven, which is said but forbids nothing. A controller that differs from the
  design's (filters, limits) lowers the correlation, not its sign.

The controller answers the gyro's noise like any motion, so a sign or a unit shows even in a calm hover. A swap does
not: where noise is all there is, axes have nothing in common, and chance and the slow settling of a hover may look
like it. So a swap counts only where both signals are stronger than what the noise alone would make of b. The noise is
measured in the same half second, by the second differences of the rate (variance 6 sigma^2 where it is white), which
motion can only make look larger.

It cannot see an error that moment and rate share, nor the true gain of the plant.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import AXES, DobDesign, StateSpaceData
from dob_companion.lti.filters import butterworth
from dob_companion.lti.statespace import ABCD, System, added, beside, series, static

Vector = NDArray[np.float64]

BAND_HZ = (3.0, 30.0)

BLOCK_S = 0.5
"""Of so much flight one correlation is taken."""

BLOCKS = 6
"""So many in a row decide. With five, rare moments of windy flights look like a swapped axis."""

PROOF = 0.6
"""Magnitude of a correlation that counts as proof, of an agreement or of an error."""

LARGEST_SCALE = 3.0
"""Slope, or its inverse, up to which units count as right: autopilots differ from the design's controller. Slopes that
differ by no more than this among themselves are one slope."""

LARGEST_RADIUS = 1.0 + 1e-6
"""Spectral radius of a plant up to which its model can be run by itself: integrators count as stable."""


@dataclass(frozen=True, slots=True, eq=False)
class _Block:
    """What half a second says.

    correlation  (3, 3)  of a of each axis with b of each
    slope        (3,)    of a on b of the same axis
    heard        (3,)    both are stronger than what the gyro's noise alone would make of b
    """

    correlation: Vector
    slope: Vector
    heard: NDArray[np.bool_]


class AxisCheck:
    """Watches [u; y_n] of all axes; `errors` names the axes with proof of an error, `unproven` those without any."""

    def __init__(self, design: DobDesign) -> None:
        self._covered = sorted(AXES.index(axis) for block in design.blocks for axis in block.axes)
        self._model = _comparison(design)
        length = round(BLOCK_S / design.dt)
        self._noise_gain = _noise_gain(self._model, BLOCKS * length)
        self._rows = np.zeros((length, 9))
        self._blocks: deque[_Block] = deque(maxlen=BLOCKS)
        self.interrupt()

    def clear(self) -> None:
        """Forget everything."""
        self._blocks.clear()
        self.interrupt()

    def interrupt(self) -> None:
        """The next sample does not follow the one before, as after a gap: the block that had begun does not count."""
        self._x = np.zeros(self._model.order)
        self._origin: Vector | None = None
        self._filled = 0

    def add(self, y_n: Iterable[float], u: Iterable[float]) -> None:
        """One sample: rates (rad/s) and the controller's own moment, correction excluded (normalized torque)."""
        inputs = np.array((*u, *y_n))
        if self._origin is None:
            self._origin = inputs
        inputs -= self._origin  # the band-pass stops constants anyway; without them it starts without a jolt
        row = self._rows[self._filled]
        row[:6] = self._model.C @ self._x + self._model.D @ inputs
        row[6:] = inputs[3:]
        self._x = self._model.A @ self._x + self._model.B @ inputs
        self._filled += 1
        if self._filled == len(self._rows):
            self._filled = 0
            self._blocks.append(_judge(self._rows, self._noise_gain))

    @property
    def ready(self) -> bool:
        """Whether enough has been seen."""
        return len(self._blocks) == BLOCKS

    def errors(self) -> list[str]:
        """What is proved wrong, an axis each, in words; empty when nothing is."""
        if not self.ready:
            return []
        correlation = self._correlation()
        return [words for i in self._covered if (words := self._error(i, correlation))]

    def unproven(self) -> list[str]:
        """Axes whose agreement is not proved either."""
        if not self.ready:
            return [AXES[i] for i in self._covered]
        correlation = self._correlation()
        return [AXES[i] for i in self._covered if correlation[i, i] < PROOF]

    @property
    def agreement(self) -> Vector:
        """(3,) Mean correlation of each axis with itself, -1…1; 0 until ready, and without motion above the noise."""
        if not self.ready:
            return np.zeros(3)
        return np.where([self._heard(i) for i in range(3)], np.diag(self._correlation()), 0.0)

    def _correlation(self) -> Vector:
        return np.asarray(np.mean([block.correlation for block in self._blocks], axis=0))

    def _error(self, i: int, correlation: Vector) -> str:
        own = np.array([block.correlation[i, i] for block in self._blocks])
        slope = np.array([block.slope[i] for block in self._blocks])
        typical = float(np.median(np.abs(slope)))
        if own.mean() <= -PROOF:
            return f"{AXES[i]} is inverted" if _right(typical) else ""
        if own.min() >= PROOF:
            alike = slope.max() <= LARGEST_SCALE * slope.min()
            wrong = not any(map(_right, slope.tolist()))
            return f"{AXES[i]} is scaled by {typical:.3g}" if alike and wrong else ""
        return self._swapped(i, correlation)

    def _swapped(self, i: int, correlation: Vector) -> str:
        """A swap takes two: neither axis is its own, and each is another's."""

        def elsewhere(j: int) -> list[int]:
            if correlation[j, j] >= PROOF or not self._heard(j):
                return []
            return [k for k in self._covered if k != j and abs(correlation[j, k]) >= PROOF]

        partners = [j for j in elsewhere(i) if elsewhere(j)]
        return f"{AXES[i]} is swapped with {AXES[partners[0]]}" if partners else ""

    def _heard(self, i: int) -> bool:
        return all(block.heard[i] for block in self._blocks)


def _right(slope: float) -> bool:
    return 1.0 / LARGEST_SCALE <= slope <= LARGEST_SCALE


def _judge(rows: Vector, noise_gain: Vector) -> _Block:
    """Partial correlations of a block's a and b, given the running sum of b. `rows` (N, 9): a, b, y_n."""
    a, b, y = rows[:, :3], rows[:, 3:6], rows[:, 6:]
    signals = np.hstack([a, b, np.cumsum(b - b.mean(axis=0), axis=0)])
    signals = signals - signals.mean(axis=0)
    products = signals.T @ signals
    aa, bb, cc = np.split(np.diag(products), 3)
    bc = np.diag(products[3:6, 6:])
    with np.errstate(divide="ignore", invalid="ignore"):
        rest_ab = products[:3, 3:6] - products[:3, 6:] * bc / cc
        rest_aa = aa[:, None] - products[:3, 6:] ** 2 / cc
        rest_bb = bb - bc**2 / cc
        correlation = np.nan_to_num(rest_ab / np.sqrt(rest_aa * rest_bb), nan=0.0, posinf=0.0, neginf=0.0)
        slope = np.nan_to_num(np.diag(rest_ab) / rest_bb, nan=0.0, posinf=0.0, neginf=0.0)
    noise = np.sqrt(np.mean(np.diff(y, 2, axis=0) ** 2, axis=0) / 6.0)
    floor = len(rows) * (noise_gain @ noise**2)
    return _Block(np.clip(correlation, -1.0, 1.0), slope, (aa > floor) & (bb > floor))


def _noise_gain(model: StateSpaceData, samples: int) -> Vector:
    """(3, 3): mean square of each b per mean square of white noise on each rate, by the pulse response."""
    x, pulses = model.B[:, 3:], [model.D[3:, 3:]]
    for _ in range(samples):
        pulses.append(model.C[3:] @ x)
        x = model.A @ x
    return np.asarray(np.sum(np.square(pulses), axis=0))


def _comparison(design: DobDesign) -> StateSpaceData:
    """[u; y_n] -> [H G u; -H G C y_n] over the three axes, H the band-pass; zero on axes that no block covers."""
    predicted, asked = (_spread_blocks(design, with_controller=choice) for choice in (False, True))
    high, low = (butterworth(design.dt, cutoff, high_pass=cutoff == BAND_HZ[0]) for cutoff in BAND_HZ)
    return StateSpaceData(*series(beside(predicted, asked), series(beside(*[low] * 6), beside(*[high] * 6))))


def _spread_blocks(design: DobDesign, with_controller: bool) -> ABCD:
    """G, or -G C, of all blocks as one 3x3 system in axis order."""
    total = static(np.zeros((3, 3)))
    for block in design.blocks:
        rows = [AXES.index(axis) for axis in block.axes]
        plant, select = block.problem.plant, static(np.eye(3)[rows])
        # run open, the model of an unstable plant would run away: moments are compared instead
        model: System = static(np.eye(len(rows))) if plant.spectral_radius > LARGEST_RADIUS else plant
        if with_controller:
            model = series(model, series(block.problem.controller, static(-np.eye(len(rows)))))
        total = added(total, series(static(select.D.T), series(model, select)))
    return total

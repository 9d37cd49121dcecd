"""correction = f · a · clip(-g · d_hat, ±limit), and how f, a, g and the limit may move.

In plain numbers: at three values each, arrays would cost several times as much.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Axes3 = tuple[float, float, float]


class CorrectionShaper:
    """Turns d_hat into the correction that is sent (docs/interfaces.md).

    f is the common fade, a the fade of each axis, g the gain. Each of them, and the limit, moves by at most
    dt / ramp a sample, so no write of a parameter can step the aircraft. Outputs are normalized torque, by axis.

    `shape` computes from a fresh estimate. `hold` computes nothing: it fades the last value that `shape` made, and
    keeps doing so until the fade has ended, because a correction is never recomputed after doubtful data.
    """

    __slots__ = ("_held", "_holding", "_limit", "a", "f", "g")

    def __init__(self, mask: Sequence[bool], gain: float, limit: float) -> None:
        self.f = 0.0
        self.a = _three(map(float, mask))
        self.g = gain
        self._limit = limit
        self._held: Axes3 = (0.0, 0.0, 0.0)
        self._holding = False

    def move(self, fade_in: bool, mask: Sequence[bool], gain: float, limit: float, step: float) -> None:
        """Advance one sample: f towards 1 or 0, a, g and limit towards their settings, each by at most `step`."""
        self.f = _towards(self.f, 1.0 if fade_in else 0.0, step)
        self.a = _three(a + _clip(float(to) - a, step) for a, to in zip(self.a, mask, strict=True))
        self.g = _towards(self.g, gain, step)
        self._limit = _towards(self._limit, limit, step)
        if self.f == 0.0:
            self._holding = False

    def shape(self, d_hat: Vector) -> Axes3:
        """The correction for a fresh, finite estimate, shape (3,)."""
        if not self._holding:
            self._held = _three(
                a * _clip(-self.g * d, self._limit) for a, d in zip(self.a, d_hat.tolist(), strict=True)
            )
        return self._faded()

    def hold(self) -> Axes3:
        """The correction without a trustworthy estimate: the last one, faded."""
        self._holding = True
        return self._faded()

    def drop(self) -> None:
        """Zero at once: something was not finite, or the time for fading is over."""
        self.f, self._holding = 0.0, False
        self._held = (0.0, 0.0, 0.0)

    def _faded(self) -> Axes3:
        return _three(self.f * held + 0.0 for held in self._held) if self.f > 0.0 else (0.0, 0.0, 0.0)


def _towards(value: float, target: float, step: float) -> float:
    return min(value + step, target) if value < target else max(value - step, target)


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def _three(values: Iterable[float]) -> Axes3:
    roll, pitch, yaw = values
    return roll, pitch, yaw

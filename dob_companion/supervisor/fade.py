"""correction = f · a · clip(-g · d_hat, ±limit), and how f, a, g and the limit may move."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


class CorrectionShaper:
    """Turns d_hat into the correction that is sent (docs/interfaces.md).

    f is the common fade, a the fade of each axis, g the gain. Each of them, and the limit, moves by at most
    dt / ramp a sample, so no write of a parameter can step the aircraft. Outputs are normalized torque, shape (3,).

    `shape` computes from a fresh estimate. `hold` computes nothing: it fades the last value that `shape` made, and
    keeps doing so until the fade has ended, because a correction is never recomputed after doubtful data.
    """

    __slots__ = ("_held", "_holding", "_limit", "a", "f", "g")

    def __init__(self, mask: Sequence[bool], gain: float, limit: float) -> None:
        self.f = 0.0
        self.a: Vector = np.array(mask, dtype=np.float64)
        self.g = gain
        self._limit = limit
        self._held: Vector = np.zeros(3)
        self._holding = False

    def move(self, fade_in: bool, mask: Sequence[bool], gain: float, limit: float, step: float) -> None:
        """Advance one sample: f towards 1 or 0, a, g and limit towards their settings, each by at most `step`."""
        self.f = _towards(self.f, 1.0 if fade_in else 0.0, step)
        self.a = self.a + np.clip(np.array(mask, dtype=np.float64) - self.a, -step, step)
        self.g = _towards(self.g, gain, step)
        self._limit = _towards(self._limit, limit, step)
        if self.f == 0.0:
            self._holding = False

    def shape(self, d_hat: Vector) -> Vector:
        """The correction for a fresh, finite estimate."""
        if not self._holding:
            self._held = self.a * np.clip(-self.g * d_hat, -self._limit, self._limit)
        return self._faded()

    def hold(self) -> Vector:
        """The correction without a trustworthy estimate: the last one, faded."""
        self._holding = True
        return self._faded()

    def drop(self) -> None:
        """Zero at once: something was not finite, or the time for fading is over."""
        self.f, self._holding = 0.0, False
        self._held = np.zeros(3)

    def _faded(self) -> Vector:
        return self.f * self._held + 0.0 if self.f > 0.0 else np.zeros(3)


def _towards(value: float, target: float, step: float) -> float:
    return min(value + step, target) if value < target else max(value - step, target)

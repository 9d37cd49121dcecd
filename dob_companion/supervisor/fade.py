"""correction = f · a · clip(-g · d_hat, ±limit), and how f, a, g and the limit may move.

In plain numbers: at three values each, arrays would cost several times as much.
"""

from collections import deque
from collections.abc import Sequence

Axes3 = tuple[float, float, float]


class CorrectionShaper:
    """Turns d_hat into the correction that is sent (docs/interfaces.md).

    f is the common fade, a the fade of each axis, g the gain. Each of them, and the limit, moves by at most
    dt / ramp a sample, so no write of a parameter can step the aircraft; f alone has a faster ramp, for an emergency.
    Outputs are normalized torque, by axis.

    `shape` computes from a fresh estimate. `hold` computes nothing: it fades the last value that `shape` made, and
    keeps doing so until the fade has ended, because a correction is never recomputed after doubtful data.

    `let_go` opens a loop that rings: nothing comes from the estimate any more. What it fades from is the mean of the
    last `memory` samples, because a swing of theirs, held, would throw the aircraft to that side.
    """

    __slots__ = ("_held", "_holding", "_limit", "_past", "a", "f", "g")

    def __init__(self, mask: Sequence[bool], gain: float, limit: float, memory: int = 25) -> None:
        self.f = 0.0
        self.a: Axes3 = (float(mask[0]), float(mask[1]), float(mask[2]))
        self.g = gain
        self._limit = limit
        self._held: Axes3 = (0.0, 0.0, 0.0)
        self._holding = False
        self._past: deque[Axes3] = deque([self._held], maxlen=memory)

    def move(self, f: float, f_step: float, mask: Sequence[bool], gain: float, limit: float, step: float) -> None:
        """Advance one sample: the fade towards `f` by at most `f_step`, a, g and limit towards their settings by at
        most `step`."""
        self.f = _towards(self.f, f, f_step)
        roll, pitch, yaw = self.a
        self.a = _towards(roll, mask[0], step), _towards(pitch, mask[1], step), _towards(yaw, mask[2], step)
        self.g = _towards(self.g, gain, step)
        self._limit = _towards(self._limit, limit, step)
        if self.f == 0.0:
            self._holding = False

    def shape(self, d_hat: Axes3) -> Axes3:
        """The correction for a fresh, finite estimate."""
        if not self._holding:
            self._held = self._asked(d_hat)
            self._past.append(self._held)
        return self._faded()

    def lower(self, d_hat: Axes3) -> None:
        """What is held until the fade has ended is no more than this estimate asks for: each axis becomes the smaller
        of both, zero where they disagree in sign."""
        (roll, pitch, yaw), (r, p, y) = self._held, self._asked(d_hat)
        self._held = _smaller(roll, r), _smaller(pitch, p), _smaller(yaw, y)
        self._holding = True

    def hold(self) -> Axes3:
        """The correction without a trustworthy estimate: the last one, faded."""
        self._holding = True
        return self._faded()

    def let_go(self) -> Axes3:
        """The correction of a loop that rings: the mean of its last swings, faded, unless a value is held already."""
        if not self._holding:
            roll, pitch, yaw = (sum(axis) / len(self._past) for axis in zip(*self._past, strict=True))
            self._held = roll, pitch, yaw
        return self.hold()

    def drop(self) -> None:
        """Zero at once: something was not finite, or the time for fading is over."""
        self.f, self._holding = 0.0, False
        self._held = (0.0, 0.0, 0.0)

    def _asked(self, d_hat: Axes3) -> Axes3:
        (roll, pitch, yaw), g, limit = self.a, self.g, self._limit
        return (
            roll * _clip(-g * d_hat[0], limit),
            pitch * _clip(-g * d_hat[1], limit),
            yaw * _clip(-g * d_hat[2], limit),
        )

    def _faded(self) -> Axes3:
        if self.f == 0.0:
            return 0.0, 0.0, 0.0
        f, (roll, pitch, yaw) = self.f, self._held
        return f * roll + 0.0, f * pitch + 0.0, f * yaw + 0.0  # never -0.0


def _towards(value: float, target: float, step: float) -> float:
    if value == target:
        return value
    return min(value + step, float(target)) if value < target else max(value - step, float(target))


def _smaller(one: float, other: float) -> float:
    if one * other <= 0.0:
        return 0.0
    return one if abs(one) < abs(other) else other


def _clip(value: float, limit: float) -> float:
    if value > limit:
        return limit
    return value if value > -limit else -limit

"""Which correction acts: newest stamp wins, nonsense is ignored whole, silence is held and then faded.

This is the vehicle's own protection against a companion that stalls, dies or talks nonsense; it depends on vehicle
time only.
"""

from enum import Enum
from math import isfinite

from sitl.attitude import ZERO, Vector

HOLD_US = 100_000
"""The last correction is held for this long without news, µs of vehicle time."""

FADE_US = 100_000
"""Then it goes linearly to zero within this time, µs."""


class Verdict(Enum):
    """What became of an offered correction."""

    TAKEN = "taken"
    NOT_FINITE = "an axis is not finite"
    TOO_LARGE = "an axis is beyond ±1"
    NOT_NEWER = "its stamp is not newer than the last"
    FUTURE = "its stamp is in the future"
    HELD = "the link holds it back"
    LOST = "the link lost it"


class CorrectionInput:
    """Takes up corrections and says which one acts at a given time."""

    def __init__(self) -> None:
        self._value: Vector = ZERO
        self._stamp_us: int | None = None
        self._news_us = 0

    def offer(self, stamp_us: int, value: Vector, now_us: int) -> Verdict:
        """Offer the correction that answers the sample stamped `stamp_us`, in vehicle time `now_us`.

        A message that is not TAKEN changes nothing at all, and does not count as news.
        """
        verdict = self._judge(stamp_us, value, now_us)
        if verdict is Verdict.TAKEN:
            self._value, self._stamp_us, self._news_us = value, stamp_us, now_us
        return verdict

    def _judge(self, stamp_us: int, value: Vector, now_us: int) -> Verdict:
        if not all(map(isfinite, value)):
            return Verdict.NOT_FINITE
        if max(value) > 1.0 or min(value) < -1.0:
            return Verdict.TOO_LARGE
        if stamp_us > now_us:
            return Verdict.FUTURE
        if self._stamp_us is not None and stamp_us <= self._stamp_us:
            return Verdict.NOT_NEWER
        return Verdict.TAKEN

    def at(self, now_us: int) -> tuple[Vector, int | None]:
        """The correction acting at `now_us` and the stamp it answers; (zero, None) when there is none (any more)."""
        silence = now_us - self._news_us
        if self._stamp_us is None or silence >= HOLD_US + FADE_US:
            return ZERO, None
        if silence <= HOLD_US:
            return self._value, self._stamp_us
        k = 1.0 - (silence - HOLD_US) / FADE_US
        x, y, z = self._value
        return (k * x, k * y, k * z), self._stamp_us

"""An oscillation that is not dying, found by its half-waves while it grows.

A half-wave is what lies between two crossings of zero: a peak and a duration. A disturbance, whatever its shape, makes
half-waves of all sizes and durations, and a well-damped loop answers a blow with a few that shrink. A loop that is
unstable makes half-waves of one duration, each larger than the one before by one factor. Two periods of that are four
half-waves, and the fourth is already recognized while it rises.

What grows by less, or is small yet, takes more half-waves to be told from chance. In any case the newest must be large
beside what the last seconds were like, so that strong gusts raise the bar and calm air does not; and our own part in
the moment must swing along, for an oscillation that we do not drive is not ours to end.

The thresholds are from hours of the simulated vehicle's gusts, payloads, failures and manoeuvres, in which chance came
to four fifths of the bars (tests/supervisor/test_ringing.py flies them again).
"""

from collections import deque
from dataclasses import dataclass
from itertools import pairwise

HALF_PERIOD_S = (0.5 / 40.0, 0.5 / 4.5)
"""Shortest and longest half-wave that counts, with room around 5 to 31 Hz for noise that shifts a crossing."""

BACKGROUND_S = 2.0
"""Time constant of the mean square that the newest peak is compared with."""

OWN_SHARE = 0.25
"""Least swing of the correction, of that of the moment, over a period of an oscillation that we drive."""


@dataclass(frozen=True, slots=True)
class Pattern:
    """So many half-waves in a row, the newest among them, that count as an oscillation.

    alike     longest over shortest duration of the complete ones, at most
    factor    least and greatest ratio of a peak to the one before
    growth    newest peak over oldest, at least
    above     newest peak over the background's root mean square, at least
    least     newest peak at least, rad/s: smaller oscillations harm nobody yet
    """

    half_waves: int
    alike: float
    factor: tuple[float, float]
    growth: float
    above: float
    least: float


PATTERNS = (
    Pattern(4, 1.4, (1.05, 3.0), 1.8, 5.5, least=0.05),
    Pattern(8, 1.35, (1.05, 3.0), 3.0, 3.0, least=0.02),
    Pattern(8, 1.35, (0.9, 2.0), 1.0, 2.3, least=0.05),
)
"""What grows fast; the same sooner, where it has grown out of calm air; what grows slowly, or not at all."""

LEAST_PEAK = min(pattern.least for pattern in PATTERNS)
_MOST = max(pattern.half_waves for pattern in PATTERNS)


class HalfWaves:
    """The half-waves of one axis. Values in rad/s; correction and moment in normalized torque."""

    def __init__(self, dt: float) -> None:
        self._shortest, self._longest = (limit / dt for limit in HALF_PERIOD_S)
        self._forget = dt / BACKGROUND_S
        self._power = 0.0
        self.clear()

    def clear(self) -> None:
        """The samples start anew; what the background was like is still known."""
        self._before = 0.0
        self._began: float | None = None
        self._at = 0
        self._peak = 0.0
        self._peaks: deque[float] = deque(maxlen=_MOST)
        self._durations: deque[float] = deque(maxlen=_MOST)
        self._moments: deque[tuple[float, float]] = deque(maxlen=round(2.0 * self._longest))

    def add(self, value: float, moment: float, correction: float) -> bool:
        """One sample; whether it belongs to an oscillation that we drive."""
        before, self._before = self._before, value
        if value * before < 0.0:
            self._cross(self._at - value / (value - before))
        self._at += 1
        self._peak = max(self._peak, abs(value))
        self._moments.append((moment, correction))
        rings = self._peak >= LEAST_PEAK and any(map(self._shows, PATTERNS)) and self._ours()
        self._power += self._forget * (value * value - self._power)
        return rings

    def _cross(self, at: float) -> None:
        """A half-wave ends at this sample, counted in parts of one, and the next begins."""
        if self._began is not None:
            self._peaks.append(self._peak)
            self._durations.append(at - self._began)
        self._began, self._peak = at, 0.0

    def _shows(self, pattern: Pattern) -> bool:
        complete = pattern.half_waves - 1
        if len(self._peaks) < complete or self._peak < max(pattern.least, pattern.above * self._power**0.5):
            return False
        durations, peaks = list(self._durations)[-complete:], [*list(self._peaks)[-complete:], self._peak]
        least, greatest = pattern.factor
        if len(self._peaks) > complete and peaks[0] > greatest * self._peaks[-complete - 1]:
            return False  # nothing that rings comes out of nothing: this is a blow and what it leaves
        return (
            self._shortest <= min(durations)
            and max(durations) <= min(self._longest, pattern.alike * min(durations))
            and self._peak >= pattern.growth * peaks[0]
            and all(least * a <= b <= greatest * a for a, b in pairwise(peaks))
        )

    def _ours(self) -> bool:
        """Whether the correction swings with the moment over the last period."""
        period = round(sum(list(self._durations)[-2:]))
        moments, corrections = zip(*list(self._moments)[-period:], strict=True)
        return bool(max(corrections) - min(corrections) >= OWN_SHARE * (max(moments) - min(moments)))

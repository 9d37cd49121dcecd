"""One stream of stamped messages, as it arrives: rates by two clocks, the pattern of its stamps, drift."""

import math
from collections import Counter, deque
from dataclasses import dataclass, field

import numpy as np

REGULAR = 0.05
"""Relative deviation from the median within which an interval counts as regular."""

MOST = 0.9
"""Share of the intervals that makes a pattern."""

RARE = 0.1
"""Share of the intervals below which a step is an exception and no part of a pattern."""

MOST_KEPT = 65_536
"""Arrivals kept, the newest: more than four minutes at 250 Hz."""

GAP = 1.5
"""Intervals longer than so many medians are gaps."""


@dataclass(slots=True)
class StreamLog:
    """Arrivals of one message of one sender: wall time in s, stamp in µs of the vehicle's clock (or None)."""

    name: str
    fine: bool = False
    wall: deque[float] = field(default_factory=lambda: deque(maxlen=MOST_KEPT))
    stamps: deque[int] = field(default_factory=lambda: deque(maxlen=MOST_KEPT))

    def add(self, now: float, stamp_us: int | None, fine: bool) -> None:
        """One message has arrived."""
        self.wall.append(now)
        self.fine = fine
        if stamp_us is not None:
            self.stamps.append(stamp_us)

    @property
    def stamped(self) -> bool:
        """Whether every message bore a stamp, and there are enough to say something."""
        return len(self.stamps) == len(self.wall) >= 3

    @property
    def rate_by_wall_hz(self) -> float:
        """Messages per second of this computer's clock; 0 below two."""
        return _rate(self.wall[0], self.wall[-1], len(self.wall)) if self.wall else 0.0

    @property
    def rate_by_stamp_hz(self) -> float:
        """Samples per second of the vehicle's clock; nan without stamps."""
        if not self.stamped:
            return math.nan
        return _rate(1e-6 * min(self.stamps), 1e-6 * max(self.stamps), len(set(self.stamps)))

    @property
    def intervals_ms(self) -> np.ndarray:
        """Differences of successive stamps, in the order of arrival, ms."""
        return np.diff(np.asarray(self.stamps, dtype=np.int64)) * 1e-3

    @property
    def backward(self) -> int:
        """Stamps that do not increase: repeated, reordered, or a clock that jumped."""
        return int(np.sum(self.intervals_ms <= 0.0))

    @property
    def gaps(self) -> int:
        """Intervals longer than 1.5 medians: samples that are missing."""
        steps = self.intervals_ms
        return int(np.sum(steps > GAP * np.median(steps))) if len(steps) else 0

    def pattern(self) -> str:
        """The stamps' intervals in words."""
        steps = self.intervals_ms
        if not len(steps):
            return "no stamps"
        middle = float(np.median(steps))
        if np.mean(np.abs(steps - middle) <= REGULAR * middle) >= MOST:
            return f"regular, {middle:.3g} ms"
        common = Counter(np.round(steps, 1).tolist()).most_common(2)
        counts = [count for _, count in common]
        if sum(counts) >= MOST * len(steps) and min(counts) > RARE * len(steps):
            return f"steps of {' and '.join(f'{step:.3g}' for step in sorted(step for step, _ in common))} ms"
        low, high = np.percentile(steps, (5, 95))
        return f"irregular, {low:.3g} to {high:.3g} ms"

    def drift_percent(self) -> tuple[float, float]:
        """How much faster the vehicle's clock runs than this one, and the standard error, both in percent.

        Slope of the stamps over the times of arrival by least squares; the scatter of arrivals gives the error.
        """
        if not self.stamped or self.wall[-1] <= self.wall[0]:
            return math.nan, math.nan
        t = np.asarray(self.wall) - np.mean(self.wall)
        s = 1e-6 * (np.asarray(self.stamps, dtype=np.float64) - np.mean(self.stamps))
        spread = float(t @ t)
        slope = float(t @ s) / spread
        residual = s - slope * t
        error = math.sqrt(float(residual @ residual) / max(1, len(t) - 2) / spread)
        return 100.0 * (slope - 1.0), 100.0 * error


def _rate(first: float, last: float, count: int) -> float:
    return (count - 1) / (last - first) if last > first else 0.0

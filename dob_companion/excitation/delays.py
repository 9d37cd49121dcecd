"""How late corrections act on this link, over a whole excitation: what a design's `delay_samples` is to be."""

import math
from collections import Counter

from dob_companion.supervisor.monitors import LATE, UNKNOWN_AGE

BY_AGE, BY_ROUND_TRIP = "age of the correction in the applied moment", "TIMESYNC round trip"

LEAST_COUNT = 250
"""Moments, a second of them, below which nothing is said."""


class Delays:
    """Ages of our part in the applied moment, samples, or what stands in for them."""

    def __init__(self) -> None:
        self._counts: Counter[int] = Counter()
        self._reported = 0

    def add(self, samples: float, *, reported: bool) -> None:
        """One moment's; `reported` by the vehicle itself. Negative or not finite counts as worse than any."""
        known = math.isfinite(samples) and 0.0 <= samples < UNKNOWN_AGE
        self._counts[round(samples) if known else UNKNOWN_AGE] += 1
        self._reported += reported

    @property
    def median(self) -> int | None:
        """Samples; None where too little is known."""
        return self._percentile(0.5)

    @property
    def late(self) -> int | None:
        """Samples that 95 % do not exceed; None where too little is known."""
        return self._percentile(LATE)

    @property
    def source(self) -> str:
        """Where the numbers come from."""
        return BY_AGE if 2 * self._reported >= self._counts.total() else BY_ROUND_TRIP

    def _percentile(self, share: float) -> int | None:
        total, seen = self._counts.total(), 0
        if total < LEAST_COUNT:
            return None
        for age in sorted(self._counts):
            seen += self._counts[age]
            if seen >= share * total:
                return age if age < UNKNOWN_AGE else None
        return None

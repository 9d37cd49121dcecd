"""When the next sample is due in real time: an absolute schedule that catches up gently. Pure."""

CATCH_UP = 4.0
"""After a stall samples follow each other at most this many times faster than real time, so that answers can still
come between them."""


class Pace:
    """Due times of samples at a fixed period on a wall clock, s.

    Each due time is the absolute schedule's, unless the last sample was flown so late that the gap to it would be
    shorter than period / `CATCH_UP`. `overruns` counts samples flown later than one period after their time.
    """

    def __init__(self, period: float, start: float) -> None:
        self._period, self._scheduled = period, start
        self.due = start
        self.overruns = 0

    def flown(self, now: float) -> None:
        """The sample that was due has been flown at `now`."""
        if now > self._scheduled + self._period:
            self.overruns += 1
        self._scheduled += self._period
        self.due = max(self._scheduled, now + self._period / CATCH_UP)

"""Whether the estimate and its way to the vehicle are as they should be: bounds, saturation, echo."""

import math
from collections import deque

Axes3 = tuple[float, float, float]

LARGEST_ESTIMATE = 2.0
"""|d_hat| of twice the whole control authority, normalized torque, is no disturbance but an error."""

LARGEST_JUMP = 1.0
"""Change of d_hat in one sample, normalized torque, that no wind makes."""

ESTIMATE_PATIENCE_S = 0.1
"""How long |d_hat| may exceed its bound."""

SATURATED = 0.98
SATURATION_SHARE = 0.25
SATURATION_WINDOW_S = 1.0
"""A moment at its stops for so much of the time has no authority left to correct with."""

ECHO_TOLERANCE = 1e-4
ECHO_PATIENCE = 5
"""Answers in a row that come back different from what was sent: somebody else injects."""

RECORD = 128
"""Answers that are remembered: half a second at 250 Hz, longer than any link that may be flown keeps one."""

JUMP_US, KEPT_US = 1_000_000, 10_000_000
"""A stamp that much older than the newest comes from a clock that has restarted. Stamps may then come a second time,
and what was said to the first may still be under way for as long as a link can keep it."""


class EstimateBounds:
    """|d_hat| and its change from sample to sample, while it is used."""

    def __init__(self, dt: float) -> None:
        self._patience = math.ceil(ESTIMATE_PATIENCE_S / dt)
        self.clear()

    def clear(self) -> None:
        """The estimate starts anew."""
        self._previous: Axes3 | None = None
        self._beyond = 0

    def broken(self, d_hat: Axes3) -> str:
        """What is impossible about this estimate, in words; "" when nothing is."""
        (roll, pitch, yaw), before = d_hat, self._previous or d_hat
        self._previous = d_hat
        jump = max(abs(roll - before[0]), abs(pitch - before[1]), abs(yaw - before[2]))
        largest = max(abs(roll), abs(pitch), abs(yaw))
        self._beyond = self._beyond + 1 if largest > LARGEST_ESTIMATE else 0
        if jump > LARGEST_JUMP:
            return f"estimate jumped by {jump:.2g}"
        if self._beyond > self._patience:
            return f"estimate beyond {LARGEST_ESTIMATE:g}"
        return ""


class Saturation:
    """Share of the last second in which an axis' applied moment was at its stops."""

    def __init__(self, dt: float) -> None:
        self._recent: deque[bool] = deque(maxlen=round(SATURATION_WINDOW_S / dt))

    def add(self, moment: Axes3) -> None:
        """One applied moment, normalized torque."""
        self._recent.append(max(map(abs, moment)) >= SATURATED)

    @property
    def excessive(self) -> bool:
        """Too much of the time at the stops."""
        return sum(self._recent) > SATURATION_SHARE * (self._recent.maxlen or 0)


class Echo:
    """What we sent, against what comes back: in the vehicle's report, or as a correction heard on the link.

    The record is short, so only what lies between its first and its newest stamp can be judged. A correction that is
    older may be our own of before, however long the link kept it; one that is newer answers a clock that has restarted.
    """

    def __init__(self, dt: float) -> None:
        self._dt_us = 1e6 * dt
        self._sent: dict[int, Axes3 | None] = {}
        self._known_from = self._newest = self._clear_at = 0
        self._different = 0

    def sent(self, stamp_us: int, correction: Axes3) -> None:
        """Remember an answer. Two that differ for one stamp, as after a fade without samples, are both ours."""
        if not self._sent:
            self._known_from = self._newest = stamp_us
        if stamp_us < self._newest - JUMP_US:
            self._sent.clear()
            self._known_from = self._newest = stamp_us
            self._clear_at = stamp_us + KEPT_US
        known = stamp_us not in self._sent or self._sent[stamp_us] == correction
        self._sent[stamp_us] = correction if known else None
        self._newest = max(self._newest, stamp_us)
        if len(self._sent) > RECORD:
            oldest = next(iter(self._sent))
            del self._sent[oldest]
            self._known_from = max(self._known_from, oldest + 1)

    def ours(self, stamp_us: int, correction: Axes3) -> bool:
        """Whether this is what we sent for the sample."""
        sent = self._sent.get(stamp_us)
        return sent is not None and all(abs(a - b) <= ECHO_TOLERANCE for a, b in zip(sent, correction, strict=True))

    def others(self, stamp_us: int, correction: Axes3) -> bool:
        """Whether this cannot be ours: we know all that we sent for such stamps, and it is not among it."""
        if not (self._sent and self._known_from <= stamp_us <= self._newest and self._newest >= self._clear_at):
            return False
        ambiguous = self._sent.get(stamp_us, correction) is None
        return not ambiguous and not self.ours(stamp_us, correction)

    def foreign(self, stamp_us: int, age_samples: float, moment: Axes3, contained: Axes3) -> bool:
        """Whether several corrections in a row were not ours.

        An age that leads to no answer of ours says nothing, nor does an axis at its stops. A vehicle may take a part of
        a correction, or nothing: it has limits of its own, and fades when its pilot switches us off.
        """
        if not (math.isfinite(age_samples) and 0.0 <= age_samples <= 20.0 and all(map(math.isfinite, contained))):
            return False
        ours = self._sent.get(stamp_us - round(age_samples * self._dt_us))
        if ours is None:
            return False
        off = any(
            not _part(there, sent) and abs(whole) < SATURATED
            for there, sent, whole in zip(contained, ours, moment, strict=True)
        )
        self._different = self._different + 1 if off else 0
        return self._different >= ECHO_PATIENCE


def _part(there: float, sent: float) -> bool:
    """Whether a correction that is contained lies between nothing and what was sent."""
    return min(0.0, sent) - ECHO_TOLERANCE <= there <= max(0.0, sent) + ECHO_TOLERANCE

"""How long the vehicle may have been without a correction of ours, on its own clock.

A vehicle holds the last correction for 100 ms without news and then takes it to zero by itself (docs/interfaces.md,
Taking up a correction). A correction that arrives after that steps the aircraft, whatever it was computed from. So
nothing but zero may be sent once that time-out *may* have passed. Two things bound the silence from here:

* the answers that left: between one and the next the vehicle cannot have heard anything (vehicle to companion cut);
* the age that the vehicle reports: as long as it names the same answer, nothing newer has come (companion to vehicle
  cut). An answer is news no earlier than the report before the one that first names it, nor than its own stamp. Where
  the last report shows that answers did not arrive, the time since without any report counts as well: one cut may have
  followed the other.

No wall time in here: a vehicle in lockstep that waits does not age.
"""

import math

TIME_OUT_US = 100_000
"""Vehicle time without news after which a vehicle begins to fade by itself."""

ON_THE_WAY = 2
"""Samples that an answer may take to the vehicle beyond what 95 % of them take."""

LEAST_ROOM = 4
"""Samples of silence that are always allowed: at a low rate, or over a slow link, nothing could be proven otherwise."""


class TakeUp:
    """Reckons the silence from answers that left and ages that were reported; `ended` judges it."""

    __slots__ = ("_answered", "_dt_us", "_left", "_news", "_reported", "_room_us", "_silence_us", "_way_us")

    def __init__(self, dt: float) -> None:
        self._dt_us = 1e6 * dt
        self._room_us = LEAST_ROOM * self._dt_us
        self._way_us = ON_THE_WAY * self._dt_us
        self.clear()

    def clear(self) -> None:
        """The vehicle has started anew and knows nothing of us."""
        self._left: int | None = None
        self._reported: int | None = None
        self._answered = self._news = -math.inf
        self._silence_us = 0.0

    def allow(self, flight_samples: int) -> None:
        """What an answer takes from here to the vehicle, in samples, has been measured anew."""
        self._way_us = (flight_samples + ON_THE_WAY) * self._dt_us
        self._room_us = max(LEAST_ROOM * self._dt_us, TIME_OUT_US - self._way_us)

    def left(self, stamp_us: int) -> None:
        """The answer to this sample has left."""
        self._left = stamp_us

    def reported(self, stamp_us: int, age_samples: float) -> None:
        """At this stamp the newest answer taken up was so old; negative: there was none; nan: the vehicle does not
        say, and every answer that leaves is taken to arrive."""
        before, taken_before = self._reported, self._answered
        if before is not None and stamp_us <= before:
            return
        self._reported = stamp_us
        if math.isnan(age_samples):
            self._silence_us = 0.0
            return
        if age_samples < 0.0:
            self._silence_us = math.inf if taken_before > -math.inf else 0.0
            return
        answered = stamp_us - age_samples * self._dt_us
        if answered > taken_before + 0.25 * self._dt_us:  # not merely the rounding of an age
            self._answered = answered
            self._news = answered if before is None else max(answered, before)
        self._silence_us = stamp_us - self._news

    def ended(self, stamp_us: int) -> str:
        """Why an answer to this sample may find a vehicle that has timed out, in words; "" when it cannot."""
        if self._left is not None and stamp_us - self._left > self._room_us:
            return f"vehicle without answers for {1e-6 * (stamp_us - self._left):.2g} s"
        return "corrections do not reach the vehicle" if self._silence(stamp_us) > self._room_us else ""

    def _silence(self, stamp_us: int) -> float:
        """Time without news by the ages reported."""
        if self._reported is None or self._silence_us <= self._way_us:
            return self._silence_us
        return self._silence_us + max(0.0, stamp_us - self._reported - self._dt_us)

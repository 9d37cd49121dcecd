"""What a link is worth: rate and delay measured on the vehicle's own stamps, judged with hysteresis."""

import math
from collections import Counter, deque
from collections.abc import Collection

from dob_companion.supervisor import ages
from dob_companion.supervisor.takeup import TakeUp

WINDOW_US = 2_000_000
"""Rate and delay are judged over the last 2 s of vehicle time."""

FULL_RATE, STILL_FULL, STILL_COMES = 0.95, 0.90, 0.75
"""Shares of a rate that count as that rate: before it is relied on; once it is, of what is sent, and of what comes."""

LATE = 0.95
"""Share of the corrections that count: the latest of them are not waited for."""

UNKNOWN_AGE = 255
"""Counted for a sample whose correction age the vehicle does not know: worse than any that may be injected with."""

MOST_OPEN = 128
"""TIMESYNC requests that may be open at once, and round trips that are kept: more than 10 s at 10 Hz."""

MOST_IN_WINDOW = 16_384
"""Messages remembered of a window at most: 8 kHz. Stamps that hardly advance must not fill the memory."""


class RateMonitor:
    """Samples per second of vehicle time over the last 2 s: those that came, and those that were sent."""

    __slots__ = ("_lost", "_stamps")

    def __init__(self) -> None:
        self._stamps: deque[int] = deque(maxlen=MOST_IN_WINDOW)
        self._lost: deque[int] = deque(maxlen=MOST_IN_WINDOW)

    def add(self, stamp_us: int, lost: int = 0) -> None:
        """Count a sample, and those that were lost between it and the one before; stamps must increase."""
        self._stamps.append(stamp_us)
        self._lost.append(lost)
        while stamp_us - self._stamps[0] > WINDOW_US:
            self._stamps.popleft()
            self._lost.popleft()

    @property
    def full(self) -> bool:
        """Whether nearly 2 s have been seen, so that the rate means something."""
        return bool(self._stamps) and self._stamps[-1] - self._stamps[0] >= FULL_RATE * WINDOW_US

    @property
    def hz(self) -> float:
        """Measured rate; 0 before the second sample."""
        if len(self._stamps) < 2:
            return 0.0
        return 1e6 * (len(self._stamps) - 1) / (self._stamps[-1] - self._stamps[0])

    @property
    def sent_hz(self) -> float:
        """At which the vehicle sends, lost samples counted; 0 before the second sample."""
        if len(self._stamps) < 2:
            return 0.0
        sent = len(self._stamps) - 1 + sum(self._lost) - self._lost[0]
        return 1e6 * sent / (self._stamps[-1] - self._stamps[0])

    def clear(self) -> None:
        """Forget all samples (the vehicle's clock has restarted)."""
        self._stamps.clear()
        self._lost.clear()


class DelayMonitor:
    """Age of the correction in the applied moment, in samples: distribution over the last 2 s."""

    __slots__ = ("_ages", "_counts")

    def __init__(self) -> None:
        self._ages: deque[tuple[int, int]] = deque()
        self._counts: Counter[int] = Counter()

    def add(self, stamp_us: int, age: float) -> None:
        """Count the age that the vehicle reports with a moment; negative or not finite counts as unknown."""
        known = math.isfinite(age) and 0.0 <= age <= UNKNOWN_AGE
        samples = round(age) if known else UNKNOWN_AGE
        self._ages.append((stamp_us, samples))
        self._counts[samples] += 1
        while abs(stamp_us - self._ages[0][0]) > WINDOW_US or len(self._ages) > MOST_IN_WINDOW:
            self._counts[self._ages.popleft()[1]] -= 1

    def percentile(self, share: float) -> int:
        """Smallest age that at least `share` (0…1) of the samples do not exceed; UNKNOWN_AGE without samples."""
        needed, seen = share * len(self._ages), 0
        for age in sorted(self._counts):
            seen += self._counts[age]
            if seen > 0 and seen >= needed:
                return age
        return UNKNOWN_AGE

    def clear(self) -> None:
        """Forget all ages."""
        self._ages.clear()
        self._counts.clear()


class RoundTrip:
    """TIMESYNC round trips of wall time, the recent ones: what the link itself takes, there and back.

    It is shown, and stands in for the delay where a vehicle does not report the age of a correction. An answer counts
    once, and only to a request of ours: others on the link ask the vehicle too, and its answers to them look like ours
    but for the time that they repeat.
    """

    __slots__ = ("_open", "_recent")

    def __init__(self) -> None:
        self._open: deque[int] = deque(maxlen=MOST_OPEN)
        self._recent: deque[tuple[float, float]] = deque(maxlen=MOST_OPEN)

    def asked(self, ts1_ns: int) -> None:
        """We sent our clock, ns."""
        self._open.append(ts1_ns)

    def answered(self, ts1_ns: int, now: float) -> float | None:
        """An answer has come at `now` (s, our clock). Its round trip in s; None when it answers nothing of ours."""
        if ts1_ns not in self._open:
            return None
        self._open.remove(ts1_ns)
        seconds = now - ts1_ns * 1e-9
        self._recent.append((now, seconds))
        self.forget(now)
        return seconds

    def forget(self, now: float) -> None:
        """Drop what is too old to say anything about the link as it is."""
        while self._recent and now - self._recent[0][0] > ages.ROUND_TRIP_S:
            self._recent.popleft()

    def percentile(self, share: float) -> float:
        """Round trip, s, that at least `share` (0…1) of the recent ones do not exceed; nan without any."""
        return percentile([seconds for _, seconds in self._recent], share)

    def delay_samples(self, dt: float) -> float:
        """Estimated age of a correction in samples: 1 + floor(median round trip / dt); nan without any."""
        median = self.percentile(0.5)
        return math.nan if math.isnan(median) else 1.0 + median // dt


def percentile(values: Collection[float], share: float) -> float:
    """The least of the values that at least `share` (0…1) of them do not exceed; nan without any."""
    if not values:
        return math.nan
    return sorted(values)[max(0, math.ceil(share * len(values)) - 1)]


class Hysteresis:
    """Good only after `rise_us` of unbroken good, bad only after `fall_us` of unbroken bad. Begins bad."""

    __slots__ = ("_fall_us", "_rise_us", "_since", "good")

    def __init__(self, rise_us: int, fall_us: int) -> None:
        self.good = False
        self._rise_us, self._fall_us = rise_us, fall_us
        self._since: int | None = None

    def update(self, stamp_us: int, good_now: bool) -> bool:
        """Take the newest judgement into account and return the settled one."""
        if good_now == self.good:
            self._since = None
            return self.good
        if self._since is None or stamp_us < self._since:
            self._since = stamp_us
        if stamp_us - self._since >= (self._rise_us if good_now else self._fall_us):
            self.good, self._since = good_now, None
        return self.good

    def reset(self) -> None:
        """Bad, and nothing good seen yet."""
        self.good, self._since = False, None


class LinkGate:
    """Whether the link is as fast and as prompt as the design needs (docs/interfaces.md, What must hold before it
    injects).

    Injecting may begin at 95 % of the design's rate, and goes on while the vehicle sends at 90 % of it and 75 % come:
    what is lost on the way is bridged, or a gap. The median delay must not exceed `delay_samples + 1`, its 95th
    percentile not `delay_samples + delay_margin_samples`. A vehicle that may have been without our corrections for
    longer than it holds them breaks it off at once.
    """

    __slots__ = (
        "_broken", "_delay_samples", "_hysteresis", "_p95_limit", "_rate_hz", "delay", "median_limit", "rate", "takeup",
        "why",
    )  # fmt: skip

    def __init__(self, rate_hz: float, delay_samples: int, delay_margin_samples: int) -> None:
        self._rate_hz, self._delay_samples = rate_hz, delay_samples
        self.median_limit = delay_samples + 1
        self._p95_limit = delay_samples + delay_margin_samples
        self._hysteresis = Hysteresis(rise_us=500_000, fall_us=100_000)
        self.rate, self.delay, self.takeup = RateMonitor(), DelayMonitor(), TakeUp(1.0 / rate_hz)
        self._broken = ""
        self.why = "measuring the link"

    @property
    def good(self) -> bool:
        """The settled judgement."""
        return self._hysteresis.good

    @property
    def delay_median(self) -> int:
        """Median delay in samples over the last 2 s."""
        return self.delay.percentile(0.5)

    @property
    def shortfall(self) -> str:
        """How much later corrections act than the design has reckoned with, on a good link; "" where they do not. It
        costs attenuation."""
        late = self.delay.percentile(LATE)
        if not self.good or late <= self._delay_samples:
            return ""
        return f"delay p95 {late} samples, designed for {self._delay_samples}"

    def broken(self, stamp_us: int) -> bool:
        """Whether the vehicle may have timed out when the answer to `stamp_us` arrives: the link must then prove
        itself anew."""
        self._broken = self.takeup.ended(stamp_us)
        if self._broken:
            self.why = self._broken
            self._hysteresis.reset()
        return bool(self._broken)

    def judge(self, stamp_us: int) -> bool:
        """Judge the link at `stamp_us`; `why` then says what is wrong with it, if anything."""
        self.takeup.allow(self.delay.percentile(LATE))
        why = self._broken or self._complaint()
        good = self._hysteresis.update(stamp_us, not why)
        self.why = why if why else ("" if good else "link not good for long enough")
        return good

    def clear(self) -> None:
        """Start measuring again, as after a restart of the vehicle's clock."""
        self.rate.clear()
        self.delay.clear()
        self.takeup.clear()
        self._hysteresis.reset()
        self.why = "measuring the link"

    def _complaint(self) -> str:
        if not self.rate.full:
            return "measuring the link"
        sent, comes = self.rate.sent_hz, self.rate.hz
        asked = ((sent, STILL_FULL), (comes, STILL_COMES)) if self._hysteresis.good else ((comes, FULL_RATE),)
        for hz, share in asked:
            if hz < share * self._rate_hz:
                return f"rate {hz:.0f} Hz below {share * self._rate_hz:.0f} Hz"
        median, late = self.delay_median, self.delay.percentile(LATE)
        if late >= UNKNOWN_AGE:
            return "vehicle reports no delay"
        if median > self.median_limit:
            return f"delay {median} samples above {self.median_limit}"
        if late > self._p95_limit:
            return f"delay p95 {late} samples above {self._p95_limit}"
        return ""

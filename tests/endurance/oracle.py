"""What a correction may be, worked out again from the messages that arrived whole, without the companion's code.

For `small_design` the observer can be written in one line, x <- (x + y_n - u_e) / 2 and d_hat = x, and so can what its
model expects: y_n = u_e + d + n with a scalar d. The oracle carries both in plain numbers, and applies the rules of
docs/interfaces.md by itself. Samples that are missing are put in as the model expects them given both sides; a moment
is held until the next, or lies on the line between two that two or more are missing between; while more than two are
missing, what the model expects stands for the gyro; all of it is put right when a moment comes late. Beyond the bounds
it is a gap, after which x = 0 and nothing fresh may be sent for 25 samples. A correction is right when it is exactly
zero, or f · clip(-x, ±limit) for x of just this stamp, or f times the last such value (a fade), with one f for all
axes, 0 <= f <= 1, that has moved by no more than dt / ramp since the correction before. A fade after a gap begins from
the smaller of that value and what the samples around the gap make likely.
"""

import math

from scipy.linalg import solve_discrete_are

DT_US = 4000
SETTLED = 25
STEP = 0.004 / 0.5
LIMIT = 0.3
TOLERANCE = 2e-6
"""Corrections travel in single precision, and x of before a gap is forgotten to 2^-25."""

LONGEST_RUN = 8
LONGEST_MOMENT = 10
HELD = 2
"""Samples, and moments, in a row that may be missing: the bounds of `small_design`, which a test holds."""

REACH = 32
"""Samples beyond which nothing is put in, not even for a fade."""

POLE, DRIVE, NOISE = 0.99, 0.01, 0.01
"""d(k+1) = POLE d + DRIVE w, n = NOISE v."""

P = float(solve_discrete_are([[POLE]], [[1.0]], [[DRIVE**2]], [[NOISE**2]])[0, 0])
KALMAN = POLE * P / (P + NOISE**2)


class Oracle:
    """Told of what arrived whole from the vehicle's autopilot, and of every correction that left."""

    def __init__(self):
        self.wrong = []
        self.fresh = self.faded = self.zero = 0
        self._newest = None
        self._y = (0.0,) * 3
        self._moments = {}
        self._intervals = []  # [begin, rates, expected rates or None] of those that a late moment may still change
        self._base = ((0.0, 0.0),) * 3  # x and d before them, by axis
        self._owed, self._spoilt, self._run = 0, False, 0
        self._f, self._held = 0.0, (0.0,) * 3

    @property
    def _x(self):
        return [x for x, _ in self._now()]

    def _awaited(self):
        """Moments that are missing, or have come while others behind them had not."""
        unknown = sum(expected is not None for _, _, expected in self._intervals)
        return max((self._newest - max(self._moments)) / DT_US, unknown + HELD if unknown else 0)

    def _unknown(self, begin):
        """Whether so many moments are missing that the gyro says nothing."""
        return begin - max(self._moments) > HELD * DT_US

    def gyro(self, stamp, y):
        """A gyro sample arrived."""
        newest = self._newest
        if newest is not None and newest - 1_000_000 < stamp <= newest:
            return  # late, or a repeat
        if not all(map(math.isfinite, y)):
            self._newest, self._spoilt, self._run = stamp, True, 0
            self._moments.clear()
            return
        if newest is None or stamp < newest:
            self._moments = {} if newest is not None else self._moments
            self._begin()
        else:
            self._next(y, round((stamp - newest) / DT_US))
        self._newest, self._y = stamp, y
        self._run += 1

    def _next(self, y, steps):
        acting = self._acting(self._newest)
        owed = self._owed + steps - 1 if steps > 1 else max(0, self._owed - 1)
        bad = self._spoilt or acting is None or steps > REACH
        if bad or owed > LONGEST_RUN or self._awaited() > LONGEST_MOMENT:
            if not bad:
                self._put_in(y, steps)
                self._held = tuple(map(_smaller, self._held, self._clipped()))
            self._begin()
        else:
            self._put_in(y, steps)
            self._owed = owed

    def _begin(self):
        self._intervals, self._base = [], ((0.0, 0.0),) * 3
        self._run, self._owed, self._spoilt = 0, 0, False

    def _put_in(self, y, steps):
        """The intervals from the newest sample to the one that has come, `steps` later."""
        begins = [self._newest + k * DT_US for k in range(steps)]
        moments = [self._moment_from(begin, held=False) for begin in begins]
        rates = [self._y]
        spread = [P]
        for _ in range(steps - 1):
            spread.append(POLE**2 * spread[-1] + DRIVE**2)
        foreseen = []
        for axis, (_, before) in enumerate(self._now()):
            d = POLE * before + KALMAN * (self._y[axis] - moments[0][axis] - before)
            foreseen.append([moments[min(k, steps - 1)][axis] + POLE ** (k - 1) * d for k in range(1, steps + 1)])
        for k in range(1, steps):
            share = POLE ** (steps - k) * spread[k - 1] / (spread[-1] + NOISE**2)
            rates.append(tuple(f[k - 1] + share * (y[axis] - f[-1]) for axis, f in enumerate(foreseen)))
        if steps == 1 and self._unknown(self._newest):
            self._intervals.append([begins[0], rates[0], self._expected()])
        else:
            self._intervals += [[begin, rate, None] for begin, rate in zip(begins, rates, strict=True)]
        kept = LONGEST_MOMENT + 2
        self._base = self._now(self._intervals[:-kept])
        del self._intervals[:-kept]

    def _expected(self):
        """What the model expects of the gyro at the newest sample."""
        acting = self._moments[self._acting(self._newest)]
        return tuple(u + d for u, (_, d) in zip(acting, self._now(), strict=True))

    def _now(self, intervals=None):
        """x and d after the intervals, by axis."""
        found = []
        for axis, state in enumerate(self._base):
            x, d = state
            for begin, rates, expected in self._intervals if intervals is None else intervals:
                y = rates if expected is None else expected
                u = self._moment_from(begin, held=expected is not None)[axis]
                x, d = (x + y[axis] - u) / 2, POLE * d + KALMAN * (y[axis] - u - d)
            found.append((x, d))
        return tuple(found)

    def _moment_from(self, begin, *, held):
        acting = self._acting(begin)
        following = min((stamp for stamp in self._moments if stamp > acting), default=None)
        if held or following is None or following - acting <= HELD * DT_US:
            return self._moments[acting]
        share = (begin + DT_US / 2 - acting) / (following - acting)
        pair = zip(self._moments[acting], self._moments[following], strict=True)
        return tuple(a + share * (b - a) for a, b in pair)

    def _acting(self, begin):
        """Stamp of the moment that acts from `begin` on; None when none is known."""
        return max((stamp for stamp in self._moments if stamp <= begin), default=None)

    def moment(self, stamp, u):
        """An applied moment arrived."""
        newest = self._newest
        if newest is not None and stamp > newest + REACH * DT_US:
            return
        if newest is None or stamp >= newest or stamp > max(self._moments, default=-1):
            self._moments.setdefault(stamp, u)
        if self._intervals and not self._unknown(self._intervals[-1][0]):
            for interval in self._intervals:
                interval[2] = None
        oldest = self._intervals[0][0] if self._intervals else newest
        acting = None if oldest is None else self._acting(oldest)
        for old in [t for t in self._moments if acting is not None and t < acting]:
            del self._moments[old]

    def spoil(self):
        """An applied moment that is not finite arrived: all is forgotten."""
        self._spoilt, self._run = True, 0
        self._moments.clear()
        self._intervals.clear()

    def _clipped(self):
        return tuple(min(max(-x, -LIMIT), LIMIT) for x in self._x)

    def correction(self, stamp, c):
        """A correction left: is there a way to it from good data?"""
        if c == (0.0, 0.0, 0.0):
            self.zero += 1
            self._f = 0.0
            return
        fresh = self._clipped()
        if stamp == self._newest and self._run >= SETTLED and not self._spoilt and self._is(c, fresh):
            self.fresh += 1
            self._held = fresh
        elif self._is(c, self._held):
            self.faded += 1
        else:
            self.wrong.append((stamp, c, fresh, self._held, self._f, self._run))

    def _is(self, c, whole):
        largest = max(range(3), key=lambda i: abs(whole[i]))
        if abs(whole[largest]) < 1e-3:
            return all(abs(a) <= abs(b) + TOLERANCE for a, b in zip(c, whole, strict=True))
        f = c[largest] / whole[largest]
        slack = TOLERANCE / abs(whole[largest])
        right = (
            -slack <= f <= 1.0 + slack
            and abs(f - self._f) <= STEP + 2 * slack
            and all(abs(a - f * b) <= 2 * TOLERANCE for a, b in zip(c, whole, strict=True))
        )
        if right:
            self._f = f
        return right


def _smaller(one, other):
    if one * other <= 0.0:
        return 0.0
    return min(one, other, key=abs)

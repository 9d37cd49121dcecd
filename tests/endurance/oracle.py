"""What a correction may be, worked out again from the messages that arrived whole, without the companion's code.

For `small_design` the observer can be written in one line, x <- (x + y_n - u_e) / 2 and d_hat = x, so the oracle
carries x in plain numbers, and applies the rules of docs/interfaces.md by itself: one missing sample is bridged by a
line (gyro) or held (moment), two are a gap after which x = 0 and nothing fresh may be sent for 25 samples. A
correction is right when it is exactly zero, or f · clip(-x, ±limit) for x of just this stamp, or f times the last
such value (a fade), with one f for all axes, 0 <= f <= 1, that has moved by no more than dt / ramp since the
correction before.
"""

import math

DT_US = 4000
SETTLED = 25
STEP = 0.004 / 0.5
LIMIT = 0.3
TOLERANCE = 2e-6
"""Corrections travel in single precision, and x of before a gap is forgotten to 2^-25."""


class Oracle:
    """Told of what arrived whole from the vehicle's autopilot, and of every correction that left."""

    def __init__(self):
        self.wrong = []
        self.fresh = self.faded = self.zero = 0
        self._newest = None
        self._y = (0.0,) * 3
        self._x = [0.0] * 3
        self._moments = {}
        self._run, self._bridged, self._spoilt = 0, False, False
        self._f, self._held = 0.0, (0.0,) * 3

    def gyro(self, stamp, y):
        """A gyro sample arrived."""
        newest = self._newest
        if newest is not None and newest - 1_000_000 < stamp <= newest:
            return  # late, or a repeat
        if not all(map(math.isfinite, y)):
            self._newest, self._spoilt, self._run = stamp, True, 0
            self._moments.clear()
            return
        steps = (stamp - newest) / DT_US if newest is not None else math.inf
        if self._spoilt or steps not in (1, 2) or (steps == 2 and self._bridged) or not self._follow(y, int(steps)):
            self._x, self._run, self._spoilt = [0.0] * 3, 0, False
            if newest is not None and stamp < newest:
                self._moments.clear()
            self._moments = {t: u for t, u in self._moments.items() if t >= stamp}
            self._bridged = False
        else:
            self._bridged = steps == 2
        self._newest, self._y = stamp, y
        self._run += 1

    def _follow(self, y, steps):
        middle = tuple((a + b) / 2 for a, b in zip(self._y, y, strict=True))
        x = self._x
        for begin, rate in zip((self._newest, self._newest + DT_US), (self._y, middle), strict=True):
            if begin == self._newest + steps * DT_US:
                break
            u = self._moments.get(begin, self._moments.get(begin - DT_US))
            if u is None:
                return False
            x = [(a + b - c) / 2 for a, b, c in zip(x, rate, u, strict=True)]
        self._x = x
        return True

    def moment(self, stamp, u):
        """An applied moment arrived."""
        if self._newest is None or stamp >= self._newest:
            self._moments.setdefault(stamp, u)
        for old in [t for t in self._moments if self._newest is not None and t < self._newest - 3 * DT_US]:
            del self._moments[old]

    def spoil(self):
        """An applied moment that is not finite arrived: all is forgotten."""
        self._spoilt, self._run = True, 0
        self._moments.clear()

    def correction(self, stamp, c):
        """A correction left: is there a way to it from good data?"""
        if c == (0.0, 0.0, 0.0):
            self.zero += 1
            self._f = 0.0
            return
        fresh = tuple(min(max(-x, -LIMIT), LIMIT) for x in self._x)
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

"""Whether the estimate and the loop behave as the design promised: bounds, saturation, innovation, echo."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import AXES, DobBlock, DobDesign
from dob_companion.lti.gramian import predictor_gain

Vector = NDArray[np.float64]
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

INNOVATION_WINDOW_S = 1.0
RINGING = 0.8
RINGING_HZ = (5.0, 31.0)
LEAST_INNOVATION = 0.02
"""An innovation of more than so many rad/s, root mean square, that repeats itself at these frequencies (autocorrelation
above RINGING after a period, below -RINGING after half of one) is a loop that rings, whatever the wind does."""

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


class Innovation:
    """Is the plant still the one designed for? A whiteness test on what the model did not foresee.

    A steady-state Kalman predictor per block (plant, weighted disturbance and weighted noise of the design's problem)
    foresees each gyro sample from the applied moment. With the right plant the innovation is nearly white, at whatever
    strength of wind; a loop that nears instability because the plant is another one rings, and so does the innovation.
    (R. K. Mehra, On the identification of variances and adaptive Kalman filtering, IEEE TAC 15(2), 1970.)
    """

    def __init__(self, design: DobDesign) -> None:
        predictors = [_predictor(block) for block in design.blocks]
        order = sum(len(A) for _, A, _, _, _ in predictors)
        self._A, self._B = np.zeros((order, order)), np.zeros((order, 6))
        self._C, self._D = np.zeros((3, order)), np.zeros((3, 6))
        at = 0
        for rows, A, B, C, D in predictors:
            states, columns = slice(at, at + len(A)), rows + [3 + row for row in rows]
            at = states.stop
            self._A[states, states], self._B[states, columns] = A, B
            self._C[rows, states] = C
            self._D[np.ix_(rows, columns)] = D
        self._recent = np.zeros((round(INNOVATION_WINDOW_S / design.dt), 3))
        shortest, longest = (round(1.0 / (hz * design.dt)) for hz in reversed(RINGING_HZ))
        self._periods = np.arange(shortest, longest + 1)
        self._x = np.zeros(order)
        self._at = 0

    def clear(self) -> None:
        """The samples start anew."""
        self._x[:] = 0.0
        self._recent[:] = 0.0

    def add(self, y_n: Axes3, u_e: Axes3) -> None:
        """One sample: rates (rad/s) and applied moment (normalized torque)."""
        inputs = np.array((*u_e, *y_n))
        self._recent[self._at] = self._C @ self._x + self._D @ inputs
        self._x = self._A @ self._x + self._B @ inputs
        self._at = (self._at + 1) % len(self._recent)

    def why_not(self) -> str:
        """The axis that rings, in words; "" when none does."""
        e = np.roll(self._recent, -self._at, axis=0)
        e = e - e.mean(axis=0)
        power = np.mean(e * e, axis=0)
        loud = np.flatnonzero(power > LEAST_INNOVATION**2)
        if not len(loud):
            return ""
        n = len(e)
        spectrum = np.fft.rfft(e[:, loud], 2 * n, axis=0)
        r = np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[:n] / ((n - np.arange(n))[:, None] * power[loud])
        rings = np.any((r[self._periods] > RINGING) & (r[self._periods // 2] < -RINGING), axis=0)
        return f"{AXES[loud[np.argmax(rings)]]} rings: not the plant designed for" if np.any(rings) else ""


def _predictor(block: DobBlock) -> tuple[list[int], Vector, Vector, Vector, Vector]:
    """[u_e; y_n] -> innovation of one block: its axes, and A, B, C, D of plant, coloured disturbance and noise."""
    plant, w_d, w_n = block.problem.plant, block.problem.disturbance_weight, block.problem.noise_weight
    n, d, v = plant.order, w_d.order, w_n.order
    k = w_d.D.shape[1]
    A = np.zeros((n + d + v, n + d + v))
    A[:n, :n], A[:n, n : n + d] = plant.A, plant.B @ w_d.C
    A[n : n + d, n : n + d], A[n + d :, n + d :] = w_d.A, w_n.A
    B_w = np.zeros((n + d + v, k + w_n.D.shape[1]))
    B_w[:n, :k], B_w[n : n + d, :k], B_w[n + d :, k:] = plant.B @ w_d.D, w_d.B, w_n.B
    C, D = np.hstack([plant.C, plant.D @ w_d.C, w_n.C]), plant.D
    B = np.vstack([plant.B, np.zeros((d + v, plant.B.shape[1]))])
    K = predictor_gain(A, C, B_w, np.hstack([plant.D @ w_d.D, w_n.D]))
    rows = [AXES.index(axis) for axis in block.axes]
    return rows, A - K @ C, np.hstack([B - K @ D, K]), -C, np.hstack([-D, np.eye(len(rows))])


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

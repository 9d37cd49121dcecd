"""K (1 + s lead) e^(-s delay) / ((s + pole) (1 + s lag)), times what is known, fitted to a response behind a hold.

Least squares on the complex misfit, each frequency weighted by its variance. The gain is linear and follows from the
rest, of either sign, so that a coarse search over the rest finds where to start. Of the structures (with a slow pole
or an integrator, with a lag or without, with flexible modes) that of the least BIC is taken, the squares counted
in units of what the richest one leaves. A lead beside the lag, of either sign, is what the rotors' own inertia does
when they change speed; it is let in only where the data insist, for with a lag and a delay it is much alike.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import t as t_distribution

from dob_companion.autopilots.transfer import Transfer
from dob_companion.identification.held import held_by_poles
from dob_companion.identification.result import Complexes, Floats

POLES, LAGS, DELAYS = (0.0, 1.0, 3.0, 8.0), (0.0, 0.01, 0.03, 0.08), (0.0, 0.005, 0.01, 0.02, 0.04, 0.08)
LEAST, MOST = np.array([0.0, 0.0, 0.0, -0.1]), np.array([30.0, 0.4, 0.25, 0.4])
"""Of slow pole (rad/s), lag, delay and lead (s)."""
SCALE = np.array([1.0, 0.01, 0.01, 0.01])
POLE, LAG, DELAY, LEAD, MODES = 0, 1, 2, 3, 4
FAR = 64.0
"""Deviations to which an interval is followed."""
SHARED = 1.4
"""Variance of parameters over that of independent frequencies: neighbouring bands share windows. By simulation."""
GAUSS_NEWTON = 4
"""Steps to the best gain, from that of fixed deviations."""
LEAST_SHARE = 0.02
"""Of the variance: what wind and noise do alike to input and output is never all of it."""
NIL = 1e-5
"""Of a parameter's scale: what a bound is as good as reached by."""
LEADS = (-0.01, 0.01, 0.03)
"""Where the search for one starts."""
INSIST = 10.0
"""BIC must be lower by this for a lead, and for a mode."""
CLEAN, LIGHT = 1.3, 0.2
"""χ² below which no mode is looked for, and the damping that one has at most: what is damped more is a filter."""
TOPS, DIPS, DAMPINGS = 6, (0.85, 0.93, 0.98, 1.02, 1.07, 1.18), (0.02, 0.06)
"""Where the search for a mode starts: tops of the misfit, the dip's frequency over the peak's, and damping ratios."""


@cache
def _poles(den: tuple[float, ...]) -> Complexes:
    return np.asarray(np.roots(den), complex)


@dataclass(frozen=True, slots=True)
class Data:
    """A response over n frequencies (rad/s) at `dt`: value, its standard deviation, and the known factor of it.

    rest, weak: see `spectra.Estimate`. Where an instrument is weak, chance draws the value towards `rest`, and the more
    it does so the smaller the deviation seems, so that weighted squares are biased. The deviation is therefore that
    which the data would have if the model were true (limited information maximum likelihood: T. Anderson and H. Rubin,
    Ann. Math. Stat. 20, 1949; in the frequency domain R. Pintelon and J. Schoukens, chapter 9).
    """

    frequency: Floats
    value: Complexes
    deviation: Floats
    known: Transfer
    dt: float
    rest: Complexes | complex = 0.0
    weak: Floats | float = 0.0

    def model(self, p: Floats) -> Complexes:
        """Response of unit gain; p: slow pole, lag, delay, lead, then each peak's and its dip's (rad/s, damping)."""
        lags = p[LAG] > NIL * SCALE[LAG]  # a search comes as near to 0 as 1e-105 s, whose pole overflows
        own = [-p[POLE]] + ([-1.0 / p[LAG]] if lags else [])
        lead = p[LAG] if lags else 1.0
        top, poles, known_lead = np.array(self.known.num), _poles(self.known.den), self.known.den[0]
        if p[LEAD]:
            top = np.convolve(top, (p[LEAD], 1.0))
        for peak, damping, dip, damping_dip in p[MODES:].reshape(-1, 4):
            top = np.convolve(top, (1.0 / dip**2, 2.0 * damping_dip / dip, 1.0))
            lead /= peak**2
            root = 1j * np.sqrt(complex(1.0 - damping**2))
            own += [peak * (-damping + root), peak * (-damping - root)]
        whole = np.concatenate([np.array(own, complex), poles])
        return held_by_poles(top, lead * known_lead, whole, p[DELAY], self.dt, self.frequency)

    def gain(self, p: Floats) -> float:
        """The best one."""
        return self._best(self.model(p))

    def residual(self, gain: float, p: Floats) -> Floats:
        """Of unit variance where only noise is left, shape (2 n,)."""
        return self._left(gain * self.model(p))

    def left(self, p: Floats) -> Floats:
        """As `residual`, at the best gain."""
        model = self.model(p)
        return self._left(self._best(model) * model)

    def _best(self, model: Complexes) -> float:
        weighted = model / self.deviation
        gain = float(np.sum((weighted.conj() * self.value / self.deviation).real) / np.sum(np.abs(weighted) ** 2))
        if not np.any(self.weak):
            return gain
        for _ in range(GAUSS_NEWTON):
            deviation = self._if_true(gain * model)
            off = (gain * model - self.value) / deviation
            widens = self.weak * (model.conj() * (gain * model - self.rest)).real / deviation**2
            slope = model / deviation - off * widens
            gain -= float(np.sum((slope.conj() * off).real) / np.sum(np.abs(slope) ** 2))
        return gain

    def _if_true(self, model: Complexes) -> Floats:
        """Deviation of the value were this the true response."""
        least = self.deviation**2 - self.weak * np.abs(self.value - self.rest) ** 2
        floor = LEAST_SHARE * self.deviation**2
        return np.asarray(np.sqrt(np.maximum(least, floor) + self.weak * np.abs(model - self.rest) ** 2))

    def _left(self, model: Complexes) -> Floats:
        misfit = (model - self.value) / self._if_true(model) * np.sqrt(2.0)
        return np.concatenate([misfit.real, misfit.imag])


@dataclass(frozen=True, slots=True)
class Fit:
    """gain, then the parameters of `Data.model`; which of these (gain not counted) were free; sum of squares."""

    gain: float
    parameters: Floats
    free: tuple[int, ...]
    squares: float
    data: Data

    @property
    def chi2(self) -> float:
        """Mean square of the misfits over what noise explains."""
        return self.squares / max(1, 2 * len(self.data.frequency) - 1 - len(self.free))

    @property
    def words(self) -> str:
        """The structure."""
        parts = ["slow pole" if POLE in self.free else "integrator"]
        parts += ["lag"] if LAG in self.free else []
        parts += ["lead"] if LEAD in self.free else []
        modes = (len(self.parameters) - MODES) // 4
        parts += [f"{modes} flexible mode{'s' * (modes > 1)}"] if modes else []
        return ", ".join([*parts, "delay"])

    def response(self, frequency: Floats, dt: float) -> Complexes:
        """The model's, at other frequencies or another rate."""
        data = Data(frequency, np.zeros(len(frequency), complex), np.ones(len(frequency)), self.data.known, dt)
        return np.asarray(self.gain * data.model(self.parameters))


def fit(
    data: Data, free: Sequence[int], start: Floats, *, fixed: dict[int, float] | None = None, apart: bool = False
) -> Fit:
    """Least squares over the free parameters from `start`; the others stay at their value there. `apart`: slow pole and
    lag keep to their side of what lies between them at the start, for exchanged they are the same model."""
    free, start = tuple(free), np.array(start, float)
    scale, most, least = _limits(start, apart=apart)
    for index, value in (fixed or {}).items():
        start[index] = value
    if not free:
        return Fit(data.gain(start), start, free, float(np.sum(data.left(start) ** 2)), data)
    at = np.array(free)

    def residual(x: Floats) -> Floats:
        p = start.copy()
        p[at] = x * scale[at]
        return data.left(p)

    low, high = least[at] / scale[at], most[at] / scale[at]
    x0 = np.clip(start[at] / scale[at], low + 1e-3 * (high - low), high - 1e-3 * (high - low))
    found = least_squares(residual, x0, bounds=(low, high), xtol=1e-7, ftol=1e-9, gtol=1e-9, max_nfev=60)
    p = start.copy()
    p[at] = np.where(np.abs(found.x) < NIL, 0.0, found.x) * scale[at]
    return Fit(data.gain(p), p, free, float(2.0 * found.cost), data)


def _limits(p: Floats, *, apart: bool = False) -> tuple[Floats, Floats, Floats]:
    """Scale, most and least of each parameter."""
    modes = p[MODES:].reshape(-1, 4)
    frequency = np.array([[w, 1.0, v, 1.0] for w, _, v, _ in modes]).ravel()
    scale = np.concatenate([SCALE, np.where(frequency > 1.0, frequency, 0.1)])
    most = np.concatenate([MOST, np.where(frequency > 1.0, 1.5 * frequency, 1.0)])
    least = np.concatenate([LEAST, np.where(frequency > 1.0, frequency / 1.5, 1e-3)])
    if apart and p[LAG] > 0.0:
        most[POLE] = min(most[POLE], max(p[POLE], 0.5 / p[LAG]))
        most[LAG] = min(most[LAG], max(2.0 * p[LAG], 1.0 / MOST[POLE]))
    return scale, most, least


def best_start(data: Data) -> Floats:
    """The best of a coarse grid over slow pole, lag and delay."""
    grid = [np.array([*p, 0.0]) for p in itertools.product(POLES, LAGS, DELAYS)]
    return min(grid, key=lambda p: float(np.sum(data.left(p) ** 2)))


def rigid(data: Data, start: Floats | None = None) -> Fit:
    """The richest structure without flexible modes. At least six frequencies."""
    plain = fit(data, (POLE, LAG, DELAY), best_start(data) if start is None else start)
    led = [fit(data, (POLE, LAG, DELAY, LEAD), plain.parameters, fixed={LEAD: lead}) for lead in LEADS]
    best = min(led, key=lambda one: one.squares)
    asked = INSIST + float(np.log(2.0 * len(data.frequency)))
    return best if (plain.squares - best.squares) / max(1.0, best.chi2) > asked else plain


def flexible(data: Data, base: Fit, most: int) -> Fit:
    """The same with up to `most` flexible modes, as many as the data insist on; `data` is of fine resolution."""
    richest = fit(data, base.free, base.parameters)
    for _ in range(most):
        more = _with_mode(richest) if richest.chi2 > CLEAN else None
        if more is None:
            break
        richest = more
    return richest


def simplest(richest: Fit) -> tuple[Fit, str]:
    """Without slow pole or lag where the data do not need them, and what speaks for the choice."""
    data = richest.data
    rest = tuple(k for k in richest.free if k not in {POLE, LAG})
    lags = ((LAG,),) if LEAD in richest.free else ((LAG,), ())
    simpler = [
        fit(data, (*pole, *lag, *rest), richest.parameters, fixed=dict.fromkeys({POLE, LAG} - {*pole, *lag}, 0.0))
        for pole in ((POLE,), ())
        for lag in lags
        if (*pole, *lag) != (POLE, LAG)
    ]
    every = (*simpler, richest)
    scatter = max(1.0, richest.chi2)
    points = float(np.log(2.0 * len(data.frequency)))
    criterion = [one.squares / scatter + points * (1 + len(one.free)) for one in every]
    order = np.argsort(criterion)
    chosen, second = (every[k] for k in order[:2])
    return chosen, f"BIC lower by {criterion[order[1]] - criterion[order[0]]:.3g} than with {second.words}"


def _with_mode(base: Fit) -> Fit | None:
    """One flexible mode more, where it helps most; None where the data do not ask for it."""
    data = base.data
    w = data.frequency
    tries = [
        np.concatenate([base.parameters, [centre, damping, ratio * centre, damping]])
        for centre in w[_worst(base)]
        for ratio in DIPS
        for damping in DAMPINGS
    ]
    if not tries:
        return None
    start = min(tries, key=lambda p: float(np.sum(data.left(p) ** 2)))
    own = tuple(range(len(start) - 4, len(start)))
    moved = fit(data, own, start)
    best = fit(data, (*base.free, *own), moved.parameters)
    asked = INSIST + len(own) * float(np.log(2.0 * len(w)))
    light = best.parameters[own[1]] < LIGHT
    return best if light and (base.squares - best.squares) / max(1.0, best.chi2) > asked else None


def _worst(base: Fit) -> NDArray[np.int64]:
    """Where the misfit has its highest tops, away from the low end, in the upper three quarters of frequencies."""
    data = base.data
    off = np.abs(base.gain * data.model(base.parameters) - data.value) / data.deviation
    tops = np.flatnonzero((off[1:-1] >= off[:-2]) & (off[1:-1] >= off[2:])) + 1
    tops = tops[tops >= len(off) // 4]
    return np.sort(tops[np.argsort(off[tops])[::-1][:TOPS]])


@dataclass(frozen=True, slots=True)
class Spread:
    """Covariance of (ln |gain|, parameters) and 95 % intervals (shape (2,)) of the gain and of each parameter."""

    covariance: NDArray[np.float64]
    gain: Floats
    parameters: Floats


def spread(richest: Fit) -> Spread:
    """Of the richest structure, whatever was chosen: what was left out may be there, as far as the data allow.

    By the curvature at the best fit, widened by the scatter that it leaves; where a parameter is near 0, by profile:
    as far as it can be moved, all others fitted anew, before the sum of squares has grown too much.
    """
    data, scatter = richest.data, SHARED * max(1.0, richest.chi2)
    free = np.array(richest.free)
    x = np.concatenate([[1.0], richest.parameters[free]])
    scale = np.concatenate([[1.0], _limits(richest.parameters)[0][free]])

    def residual(at: Floats) -> Floats:
        p = richest.parameters.copy()
        p[free] = at[1:]
        return data.residual(richest.gain * at[0], p)

    least = np.concatenate([[0.0], _limits(richest.parameters)[2][free]])
    most = np.concatenate([[np.inf], _limits(richest.parameters, apart=True)[1][free]])
    columns = []
    for step in np.diag(1e-4 * scale):
        above, below = x + step, np.maximum(x - step, least)
        columns.append((residual(above) - residual(below)) / np.sum(above - below))
    jacobian = np.array(columns).T
    covariance = scatter * np.linalg.pinv(jacobian.T @ jacobian)
    quantile = float(t_distribution.ppf(0.975, max(2, 2 * len(data.frequency) - len(x))))
    deviation = np.sqrt(np.diag(covariance))
    intervals = x[:, None] + quantile * deviation[:, None] * np.array([-1.0, 1.0])
    near = x - least < 1.3 * quantile * deviation
    if np.any(near[: 1 + MODES]):  # near a bound the curvature says little
        limit = richest.squares + scatter * quantile**2
        for k in range(1 + sum(index < MODES for index in richest.free)):
            for side, end in ((0, least[k]), (1, most[k])):
                intervals[k, side] = _profiled(richest, k, limit, (x[k], deviation[k], end), side)
    parameters = np.repeat(richest.parameters[:, None], 2, axis=1)
    parameters[free] = np.maximum(intervals[1:], least[1:, None])
    whole = np.zeros((1 + len(richest.parameters),) * 2)
    whole[np.ix_([0, *(1 + free)], [0, *(1 + free)])] = covariance
    return Spread(whole, np.sort(richest.gain * intervals[0]), parameters)


def _profiled(richest: Fit, which: int, limit: float, about: tuple[float, float, float], side: int) -> float:
    """Where the sum of squares passes `limit`, all else fitted anew; the end where it does not before. `about`: value,
    deviation and end."""
    at, deviation, end = about
    sign, floor = (-1.0 if side == 0 else 1.0), richest.squares

    def rise(reach: float) -> float:
        """The root of the growth, near to linear in the distance, over that of the limit."""
        return float(np.sqrt(max(_squares(richest, which, at + sign * reach) - floor, 0.0) / (limit - floor)))

    farthest = sign * (end - at)
    if farthest <= 0.0:
        return end
    inner, low, outer = 0.0, 0.0, min(2.0 * deviation, farthest)
    high = rise(outer)
    while high < 1.0 and outer < farthest and outer < FAR * deviation:
        inner, low, outer = outer, high, min(2.0 * outer, farthest)
        high = rise(outer)
    if high <= 1.0:
        return at + sign * outer
    for _ in range(4):
        middle = inner + (outer - inner) * min(max((1.0 - low) / (high - low), 0.1), 0.9)
        found = rise(middle)
        if abs(found - 1.0) < 0.03:
            return at + sign * middle
        inner, low, outer, high = (middle, found, outer, high) if found < 1.0 else (inner, low, middle, found)
    return at + sign * outer


def _squares(richest: Fit, which: int, value: float) -> float:
    """The sum with the gain (0, relative) or a free parameter at this value, all else fitted anew."""
    if which == 0:
        return _of_gain(richest, value * richest.gain)
    index = richest.free[which - 1]
    rest = tuple(k for k in richest.free if k != index)
    return fit(richest.data, rest, richest.parameters, fixed={index: value}, apart=True).squares


def _of_gain(richest: Fit, gain: float) -> float:
    """Sum of squares at this gain, the rest fitted anew."""
    at = np.array(richest.free)
    scale, most, least = _limits(richest.parameters, apart=True)

    def residual(x: Floats) -> Floats:
        p = richest.parameters.copy()
        p[at] = x * scale[at]
        return richest.data.residual(gain, p)

    low, high = least[at] / scale[at], most[at] / scale[at]
    x0 = np.clip(richest.parameters[at] / scale[at], low + 1e-3 * (high - low), high - 1e-3 * (high - low))
    return float(2.0 * least_squares(residual, x0, bounds=(low, high), xtol=1e-6, ftol=1e-8, max_nfev=30).cost)

"""K (1 + s lead) e^(-s delay) / ((s + pole) (1 + s lag)), times what is known, fitted to a response behind a hold.

Least squares on the complex misfit, each frequency weighted by its variance. The gain is linear and follows from the
rest, of either sign, so that a coarse search over the rest finds where to start. Of the structures (with a slow pole
or an integrator, with a lag or without, flexible modes when asked) that of the least BIC is taken, the squares counted
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
SHARED = 1.4
"""Variance of parameters over that of independent frequencies: neighbouring bands share windows. By simulation."""
NIL = 1e-5
"""Of a parameter's scale: what a bound is as good as reached by."""
LEADS = (-0.01, 0.01, 0.03)
"""Where the search for one starts."""
INSIST = 10.0
"""BIC must be lower by this for a lead, and for a mode."""


@cache
def _poles(den: tuple[float, ...]) -> Complexes:
    return np.asarray(np.roots(den), complex)


@dataclass(frozen=True, slots=True)
class Data:
    """A response over n frequencies (rad/s) at `dt`: value, its standard deviation, and the known factor of it."""

    frequency: Floats
    value: Complexes
    deviation: Floats
    known: Transfer
    dt: float

    def model(self, p: Floats) -> Complexes:
        """Response of unit gain; p: slow pole, lag, delay, lead, then each peak's and its dip's (rad/s, damping)."""
        own = [-p[POLE]] + ([-1.0 / p[LAG]] if p[LAG] > 0.0 else [])
        lead = p[LAG] if p[LAG] > 0.0 else 1.0
        top, poles, known_lead = np.array(self.known.num), _poles(self.known.den), self.known.den[0]
        if p[LEAD]:
            top = np.polymul(top, (p[LEAD], 1.0))
        for peak, damping, dip, damping_dip in p[MODES:].reshape(-1, 4):
            top = np.polymul(top, (1.0 / dip**2, 2.0 * damping_dip / dip, 1.0))
            lead /= peak**2
            root = 1j * np.sqrt(complex(1.0 - damping**2))
            own += [peak * (-damping + root), peak * (-damping - root)]
        whole = np.concatenate([np.array(own, complex), poles])
        return held_by_poles(top, lead * known_lead, whole, p[DELAY], self.dt, self.frequency)

    def gain(self, p: Floats) -> float:
        """The best one."""
        model = self.model(p) / self.deviation
        return float(np.sum((model.conj() * self.value / self.deviation).real) / np.sum(np.abs(model) ** 2))

    def residual(self, gain: float, p: Floats) -> Floats:
        """Of unit variance where only noise is left, shape (2 n,)."""
        misfit = (gain * self.model(p) - self.value) / self.deviation * np.sqrt(2.0)
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


def fit(data: Data, free: Sequence[int], start: Floats, *, fixed: dict[int, float] | None = None) -> Fit:
    """Least squares over the free parameters from `start`; the others stay at their value there."""
    free, start = tuple(free), np.array(start, float)
    for index, value in (fixed or {}).items():
        start[index] = value
    if not free:
        gain = data.gain(start)
        return Fit(gain, start, free, float(np.sum(data.residual(gain, start) ** 2)), data)
    scale, most, least = _limits(start)
    at = np.array(free)

    def residual(x: Floats) -> Floats:
        p = start.copy()
        p[at] = x * scale[at]
        return data.residual(data.gain(p), p)

    low, high = least[at] / scale[at], most[at] / scale[at]
    x0 = np.clip(start[at] / scale[at], low + 1e-3 * (high - low), high - 1e-3 * (high - low))
    found = least_squares(residual, x0, bounds=(low, high), xtol=1e-7, ftol=1e-9, gtol=1e-9, max_nfev=60)
    p = start.copy()
    p[at] = np.where(np.abs(found.x) < NIL, 0.0, found.x) * scale[at]
    return Fit(data.gain(p), p, free, float(2.0 * found.cost), data)


def _limits(p: Floats) -> tuple[Floats, Floats, Floats]:
    """Scale, most and least of each parameter."""
    modes = p[MODES:].reshape(-1, 4)
    frequency = np.array([[w, 1.0, v, 1.0] for w, _, v, _ in modes]).ravel()
    scale = np.concatenate([SCALE, np.where(frequency > 1.0, frequency, 0.1)])
    most = np.concatenate([MOST, np.where(frequency > 1.0, 1.5 * frequency, 1.0)])
    least = np.concatenate([LEAST, np.where(frequency > 1.0, frequency / 1.5, 1e-3)])
    return scale, most, least


def best_start(data: Data) -> Floats:
    """The best of a coarse grid over slow pole, lag and delay."""
    grid = [np.array([*p, 0.0]) for p in itertools.product(POLES, LAGS, DELAYS)]
    return min(grid, key=lambda p: float(np.sum(data.residual(data.gain(p), p) ** 2)))


def fit_structures(data: Data, modes: int = 0, start: Floats | None = None) -> tuple[Fit, Fit, str]:
    """The chosen structure, the richest, and what speaks for the choice. At least six frequencies."""
    begin = best_start(data) if start is None else start
    richest = fit(data, (POLE, LAG, DELAY), begin)
    led = [fit(data, (POLE, LAG, DELAY, LEAD), richest.parameters, fixed={LEAD: lead}) for lead in LEADS]
    best = min(led, key=lambda one: one.squares)
    points = float(np.log(2.0 * len(data.frequency)))
    if (richest.squares - best.squares) / max(1.0, best.chi2) > INSIST + points:
        richest = best
    for _ in range(modes):
        richest = _with_mode(richest)
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
    criterion = [one.squares / scatter + points * (1 + len(one.free)) for one in every]
    order = np.argsort(criterion)
    chosen, second = (every[k] for k in order[:2])
    why = f"BIC lower by {criterion[order[1]] - criterion[order[0]]:.3g} than with {second.words}"
    return chosen, richest, why


def _with_mode(base: Fit) -> Fit:
    """One flexible mode more, where it helps most; none where the data do not ask for it."""
    data = base.data
    w = data.frequency
    tries = [
        np.concatenate([base.parameters, [centre, damping, ratio * centre, damping]])
        for centre in np.geomspace(w[len(w) // 4], w[-1], 40)
        for ratio in (0.85, 0.93, 1.07, 1.18)
        for damping in (0.02, 0.06)
    ]
    start = min(tries, key=lambda p: float(np.sum(data.residual(data.gain(p), p) ** 2)))
    own = tuple(range(len(start) - 4, len(start)))
    moved = fit(data, own, start)
    best = fit(data, (*base.free, *own), moved.parameters)
    asked = INSIST + len(own) * float(np.log(2.0 * len(w)))
    return best if (base.squares - best.squares) / max(1.0, best.chi2) > asked else base


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
        for k in range(len(x)):
            for side in (0, 1):
                intervals[k, side] = _profiled(richest, k, side, limit, x[k], deviation[k], least[k])
    parameters = np.repeat(richest.parameters[:, None], 2, axis=1)
    parameters[free] = np.maximum(intervals[1:], least[1:, None])
    whole = np.zeros((1 + len(richest.parameters),) * 2)
    whole[np.ix_([0, *(1 + free)], [0, *(1 + free)])] = covariance
    return Spread(whole, np.sort(richest.gain * intervals[0]), parameters)


def _profiled(richest: Fit, which: int, side: int, limit: float, at: float, deviation: float, least: float) -> float:
    """Where the sum of squares passes `limit`, all else fitted anew; `least` where it does not before."""
    data = richest.data
    start = richest.parameters

    def squares(value: float) -> float:
        if which == 0:
            return _of_gain(richest, value * richest.gain)
        index = richest.free[which - 1]
        rest = tuple(k for k in richest.free if k != index)
        return fit(data, rest, start, fixed={index: value}).squares

    # The root of the rise is near to linear in the distance: a few secants find where it is 1.
    sign, floor = (-1.0 if side == 0 else 1.0), richest.squares
    reach = 2.0 * deviation
    for _ in range(4):
        value = max(least, at + sign * reach)
        rise = np.sqrt(max(squares(value) - floor, 0.0) / (limit - floor))
        if abs(rise - 1.0) < 0.03 or (value == least and rise <= 1.0):
            return value
        reach = abs(value - at) / max(rise, 0.3)
    return max(least, at + sign * reach)


def _of_gain(richest: Fit, gain: float) -> float:
    """Sum of squares at this gain, the rest fitted anew."""
    at = np.array(richest.free)
    scale, most, least = _limits(richest.parameters)

    def residual(x: Floats) -> Floats:
        p = richest.parameters.copy()
        p[at] = x * scale[at]
        return richest.data.residual(gain, p)

    low, high = least[at] / scale[at], most[at] / scale[at]
    x0 = np.clip(richest.parameters[at] / scale[at], low + 1e-3 * (high - low), high - 1e-3 * (high - low))
    return float(2.0 * least_squares(residual, x0, bounds=(low, high), xtol=1e-6, ftol=1e-8, max_nfev=30).cost)

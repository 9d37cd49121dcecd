"""Weights searched, as `design --auto` once did: a family of three numbers and a choice of lags.

W_d is a first-order lag, used once or twice on every moment; W_n, on every rate, a first-order lead over white noise::

    W_d = ((z + 0.9) / (z - a))^lags               a = exp(-2 pi disturbance_hz dt)
    W_n = level (z - b) / z                        b = exp(-2 pi noise_hz dt)
    level so that ||W_d G|| = |W_n| at crossing_hz, row by row: below it the observer believes in disturbance

Only the ratio of the weights matters for the observer; both are scaled so that gamma is 1 and they can be read as the
bounds that they become. A grid over (lags, disturbance_hz, crossing_hz, noise_hz), each point the central observer at
the back-off of its own gamma* by the Riccati equation alone; then from the best point seen by linear models of
attenuation and limits (COBYLA: M. J. D. Powell, "A direct search optimization method that models the objective and
constraint functions by linear interpolation", 1994), once for every row of the trade-off. Deterministic, but local: a
looser limit may give less.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from dob_companion.lti.response import response
from dob_companion.synthesis.plant.estimation import estimation_problem
from dob_companion.synthesis.plant.models import stack, zpk
from dob_companion.synthesis.solve.riccati import central_filter
from dob_companion.synthesis.solve.scaling import WhiteProblem, whitened
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import Zpk
from dob_companion.synthesis.tune.limits import Limits
from dob_companion.synthesis.tune.yardstick import Measured, Yardstick

Array = NDArray[np.float64]

LAGS = (1, 2)
GRID = (5, 6, 2)
"""Grid points of disturbance_hz, crossing_hz and noise_hz."""

POLISH_STEPS, FRONT_STEPS = (45, 30), (35,)
"""Evaluations of each climb, every one begun afresh at the best point: for the choice, and for every other row."""

NO_ANSWER = 30.0
"""Logarithm that stands for an observer that could not be found."""

SHARES_OF_MARGIN = (0.5, 0.75, 1.25, 1.5, 2.0)
SHARES_OF_NOISE = (0.25, 0.5)
"""Other requirements for which the trade-off is shown."""

GAMMA_WIDTH = 5e-4
"""Relative width to which gamma* is known during the search."""


@dataclass(frozen=True, slots=True)
class Knobs:
    """The parameters of the weights; frequencies in Hz."""

    lags: int
    disturbance_hz: float
    crossing_hz: float
    noise_hz: float


@dataclass(frozen=True, slots=True)
class Candidate:
    """Weights, the level gamma* that they have unscaled, and what their observer measures."""

    knobs: Knobs
    gamma: float
    measured: Measured


class Family:
    """The weights over their knobs, for one plant."""

    def __init__(self, plant: Any, delays: tuple[int, ...], auto: AutoSpec) -> None:
        """`low` and `high` bound the logarithms of disturbance_hz, crossing_hz and noise_hz."""
        self.plant, self.delays, self.dt = plant, delays, float(plant.dt)
        rate = 1.0 / self.dt
        self.low = np.log([auto.low_hz / 5.0, min(auto.high_hz, 0.1 * rate) / 2.0, auto.low_hz])
        self.high = np.log([auto.high_hz, 0.4 * rate, rate])  # a corner at the rate leaves the noise white

    @property
    def middle(self) -> Array:
        """The middle of the bounds."""
        return np.asarray((self.low + self.high) / 2.0)

    def knobs(self, lags: int, x: Array) -> Knobs:
        """From logarithms, kept within the bounds."""
        return Knobs(lags, *np.exp(np.clip(x, self.low, self.high)).tolist())

    def forms(self, knobs: Knobs, gamma: float = 1.0) -> tuple[Zpk, tuple[Zpk, ...]]:
        """(W_d of each moment, W_n of each rate), divided by gamma."""
        a, b = (float(np.exp(-2.0 * np.pi * f * self.dt)) for f in (knobs.disturbance_hz, knobs.noise_hz))
        W_d = Zpk((-0.9,) * knobs.lags, (a,) * knobs.lags, ((1.0 - a) / 1.9) ** knobs.lags / gamma)
        at = np.array([2.0 * np.pi * knobs.crossing_hz * self.dt])
        shape = Zpk((b,), (0.0,), 1.0)
        wanted = np.linalg.norm(response(self.plant, at)[0], axis=1) * self._gain(W_d, at) / self._gain(shape, at)
        return W_d, tuple(replace(shape, gain=float(gain)) for gain in wanted)

    def systems(self, knobs: Knobs) -> tuple[Any, Any]:
        """The same as state space, gamma not divided out."""
        W_d, W_n = self.forms(knobs)
        return self.system([W_d] * len(self.delays)), self.system(W_n)

    def system(self, forms: Sequence[Zpk]) -> Any:
        """Diagonal state space."""
        return stack(zpk(form.zeros, form.poles, form.gain, self.dt) for form in forms)

    def _gain(self, form: Zpk, at: Array) -> float:
        return float(np.abs(response(self.system([form]), at))[0, 0, 0])


class Search:
    """Everything measured so far, and where to look next."""

    def __init__(self, family: Family, yardstick: Yardstick, backoff: float) -> None:
        self.family, self.yardstick, self.backoff = family, yardstick, backoff
        self.pool: list[Candidate] = []
        self._guess = 1.0

    def grid(self) -> None:
        """Measure the whole grid."""
        spans = [np.linspace(*span) for span in zip(self.family.low, self.family.high, GRID, strict=True)]
        for lags, *x in product(LAGS, *spans):
            self.measure(self.family.knobs(int(lags), np.array(x)))

    def best(self, limits: Limits, steps: tuple[int, ...]) -> Candidate | None:
        """The greatest attenuation within the limits, after searching from the best so far; None when there is none."""
        for count in steps if self.pool else ():
            self._climb(limits, count)
        kept = [candidate for candidate in self.pool if limits.excess(candidate.measured) == 0.0]
        best = max(kept, key=lambda candidate: candidate.measured.attenuation, default=None)
        return best if best and best.measured.attenuation > 1.0 else None

    def _climb(self, limits: Limits, steps: int) -> None:
        """From the best point seen by linear models of attenuation and limits; knobs as shares of their bounds."""
        start = min(self.pool, key=lambda candidate: _cost(candidate, limits)).knobs
        low, span = self.family.low, self.family.high - self.family.low
        seen: dict[bytes, Measured | None] = {}

        def measured(x: Array) -> Measured | None:
            if x.tobytes() not in seen:
                found = self.measure(self.family.knobs(start.lags, low + span * x))
                seen[x.tobytes()] = found.measured if found else None
            return seen[x.tobytes()]

        def height(x: Array) -> float:
            m = measured(x)
            return -float(np.log(m.attenuation)) if m else NO_ANSWER

        def room(x: Array) -> Array:
            m = measured(x)
            return np.concatenate([limits.room(m) if m else np.full(4, -NO_ANSWER), x, 1.0 - x])

        x = (np.log([start.disturbance_hz, start.crossing_hz, start.noise_hz]) - low) / span
        options: Any = {"maxiter": steps, "rhobeg": 0.08, "tol": 1e-3}
        limited: Any = {"type": "ineq", "fun": room}
        optimize.minimize(height, x, method="COBYLA", constraints=limited, options=options)

    def rows(self, asked: Limits) -> None:
        """Look for the trade-off around what was asked as well: each row may help another."""
        if self.best(asked, POLISH_STEPS) is None:
            return
        others = [replace(asked, disk_margin=share * asked.disk_margin) for share in SHARES_OF_MARGIN]
        others = [limits for limits in others if limits.disk_margin < self.yardstick.disk_margin_off]
        for limits in others:
            self.best(limits, FRONT_STEPS)
        quieter: list[Limits] = []
        for _ in range(2):  # quieter limits may lead to better ground, from which they are stated again
            here = self.best(asked, FRONT_STEPS)
            noise = min(asked.noise, here.measured.noise) if here else asked.noise
            quieter = [replace(asked, noise=share * noise) for share in SHARES_OF_NOISE]
            for limits in quieter:
                self.best(limits, FRONT_STEPS)

    def refusal(self, asked: Limits) -> str:
        """Why nothing keeps the limits, with the nearest that was found."""
        wish = (
            f"no weights found with disk margin >= {asked.disk_margin:.3g}, delay margin >= {asked.delay_margin:g}, "
            f"noise in the correction <= {asked.noise:.3g} and slowest mode <= {asked.slowest_s:.3g} s that attenuate"
        )
        off = f"the loop without observer has disk margin {self.yardstick.disk_margin_off:.3g}"
        if not self.pool:
            return f"{wish}; {off}"
        m = min(self.pool, key=lambda candidate: asked.excess(candidate.measured)).measured
        near = (
            f"{m.disk_margin:.3g}, {m.delay_margin:.3g}, {m.noise:.3g}, {m.slowest_s:.3g} s, "
            f"attenuation {m.attenuation:.3g}"
        )
        return f"{wish}; nearest: {near}; {off}"

    def measure(self, knobs: Knobs) -> Candidate | None:
        """Solve at these knobs and add to the pool; None where rounding leaves no answer."""
        posed = estimation_problem(self.family.plant, *self.family.systems(knobs), self.family.delays)
        try:
            white = whitened(posed)
        except (np.linalg.LinAlgError, ValueError):
            return None
        level = self._gamma_star(white)
        found = central_filter(white.problem, self.backoff * level)
        measured = self.yardstick.measure(posed.observer(*white.gains(found.K, found.K_z))) if found else None
        if measured is None:
            return None
        self.pool.append(Candidate(knobs, level * white.level, measured))
        return self.pool[-1]

    def _gamma_star(self, white: WhiteProblem) -> float:
        """Feasible end of a bracket GAMMA_WIDTH wide, in white units, begun where the last one ended."""
        low = high = self._guess
        step = 0.01
        while central_filter(white.problem, high) is None and high < 1e6:
            low, high, step = high, high * (1.0 + step), 2.0 * step
        while low == high or (low > 1e-6 and central_filter(white.problem, low) is not None):
            low, high, step = low / (1.0 + step), low, 2.0 * step
        while high > low * (1.0 + GAMMA_WIDTH):
            middle = float(np.sqrt(low * high))
            low, high = (low, middle) if central_filter(white.problem, middle) else (middle, high)
        self._guess = high
        return high


def tightened(limits: Limits, slack: float) -> Limits:
    """Limits that leave room for `slack`."""
    return Limits(
        limits.disk_margin * slack, limits.noise / slack, limits.slowest_s / slack, limits.delay_margin * slack
    )


def _cost(candidate: Candidate, limits: Limits) -> float:
    """To be least: the attenuation, with a wall where the limits are broken."""
    return -float(np.log(candidate.measured.attenuation)) + 100.0 * limits.excess(candidate.measured)

"""How much may be missing between two samples before an estimate is worth too little to correct with.

A design foresees the size of its own error: d - z^-tau d_hat in its loop, driven by the weather that its spec states,
or by its weights where it states none. What stands in the place of missing samples (`GyroModel.bridge`, a moment that
is held) adds to it; the difference from an observer with complete data is Gaussian, with a covariance that follows from
the same loop. The bound: the longest run of missing samples by which the root mean square of the whole error at most
doubles, then or at any sample after.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import Certificate, DobDesign, Problem
from dob_companion.lti.gramian import gramian
from dob_companion.lti.loop import weighted_loop
from dob_companion.lti.predictor import Predictor, Weighted
from dob_companion.lti.statespace import StateSpaceData, System, powers

Array = NDArray[np.float64]

LONGEST_S = 0.1
"""A vehicle holds a correction for so long (docs/interfaces.md, Taking up a correction)."""

MOST = 30
"""Samples that are ever bridged, at rates at which 0.1 s would be more."""

LEAST = 1
"""One missing sample is always borne, since no link is without, even where a very fast design says 0."""

HELD = 2
"""Moments in a row that may be missing while the last one is held and the gyro's samples are used; after more, those
that the model expects stand for them until a moment comes."""

GROWTH = 2.0
"""The root mean square of the estimation error may become so many times what it is with complete data."""


AFTERWARDS = 25
"""Samples after the missing ones within which the error that they leave behind is at its largest."""


class Weather(NamedTuple):
    """What a spec states: rms of the disturbance (normalized torque) and the corner of its low-pass, rms of the gyro's
    white noise (rad/s), each axis alike."""

    disturbance_rms: float
    corner_hz: float
    noise_rms: float


WEATHER = "weather"
"""Name of a further finding of a certificate, an object with the fields of `Weather`."""


class Missing(NamedTuple):
    """Samples in a row that may be missing: of gyro and moment together, and of the moment alone."""

    samples: int
    moments: int


class _Problem(Weighted, Protocol):
    @property
    def controller(self) -> System: ...


def longest(dt: float) -> int:
    """Samples in a row that are ever bridged at a sample time of dt, in s."""
    return min(MOST, max(1, round(LONGEST_S / dt)))


def missing_samples(design: DobDesign) -> Missing:
    """The bounds of a design: those of its weakest block."""
    each = [
        _missing_in(block.problem, block.observer, block.delay_samples, design.dt, stated_weather(block.certificate))
        for block in design.blocks
    ]
    return Missing(min(bound.samples for bound in each), min(bound.moments for bound in each))


@lru_cache(maxsize=16)
def _missing_in(problem: Problem, observer: StateSpaceData, delay: int, dt: float, weather: Weather | None) -> Missing:
    """`missing_in` of frozen matrices, found once for a design however often a flight begins with it."""
    return missing_in(problem, observer, delay, dt, weather)


def stated_weather(certificate: Certificate) -> Weather | None:
    """What the spec of a certified block stated; None where it stated nothing, or nothing that is a weather."""
    stated = certificate.extra.get(WEATHER)
    if not isinstance(stated, Mapping):
        return None
    values = [stated.get(name) for name in Weather._fields]
    numbers = [float(value) for value in values if isinstance(value, int | float) and 0.0 < value < np.inf]
    return Weather(*numbers) if len(numbers) == len(values) else None


def missing_in(problem: _Problem, observer: System, delay: int, dt: float, weather: Weather | None = None) -> Missing:
    """The bounds of one block with a correction `delay` samples old, at a sample time of dt, s.

    Raises NotConvergedError for a loop that is unstable, or a problem whose predictor does not come to rest.
    """
    most = longest(dt)
    weights = (problem.disturbance_weight, problem.noise_weight)
    if weather is not None:
        weights = _weights(weather, dt, *problem.plant.D.shape)
    flight = _Flight(problem, observer, delay, most + 2, *weights)
    allowed = np.sqrt(GROWTH**2 - 1.0) * flight.error_rms
    return Missing(
        _longest_run(lambda missing: bool(np.all(flight.without_pairs(missing) <= allowed)), most),
        _longest_run(lambda missing: bool(np.all(flight.without_moments(missing) <= allowed)), most),
    )


def _weights(weather: Weather, dt: float, rates: int, moments: int) -> tuple[System, System]:
    """Disturbance and noise, each axis of its own."""
    pole = float(np.exp(-2.0 * np.pi * weather.corner_hz * dt))
    one, size = np.eye(moments), weather.disturbance_rms * np.sqrt(1.0 - pole**2)
    disturbance = StateSpaceData(pole * one, one, size * one, 0.0 * one)
    return disturbance, StateSpaceData([], [], [], weather.noise_rms * np.eye(rates))


def _longest_run(bearable: Callable[[int], bool], most: int) -> int:
    return max(LEAST, next((missing for missing in range(most) if not bearable(missing + 1)), most))


class _Flight:
    """Some samples of the design's loop and predictor in their steady state, as linear maps of one white vector.

    The root mean square of any linear combination is then the norm of its row. Samples are counted from 0, the last
    that is known before something is missing.
    """

    def __init__(
        self, problem: _Problem, observer: System, delay: int, samples: int, disturbance: System, noise: System
    ) -> None:
        self._observer = observer
        self._predictor = predictor = Predictor.of(problem)
        self._bridges = predictor.bridging(samples)
        self._afterwards = powers(observer.A.T, observer.C.T, AFTERWARDS).transpose(0, 2, 1)  # C A^k
        loop = weighted_loop(problem.plant, problem.controller, observer, disturbance, noise, delay)
        n, k, w = len(loop.A), len(predictor.A), loop.B.shape[1]
        (C_y, D_y), (C_u, D_u), (C_e, D_e) = loop.y_n, loop.u_e, loop.error
        K, F = predictor.K, predictor.A - predictor.K @ predictor.C
        G = predictor.B - K @ predictor.D
        A = np.block([[loop.A, np.zeros((n, k))], [G @ C_u + K @ C_y, F]])
        B = np.vstack([loop.B, G @ D_u + K @ D_y])
        steady = gramian(A, B)
        self.error_rms = np.sqrt(np.diag(C_e @ steady[:n, :n] @ C_e.T + D_e @ D_e.T))
        size = n + k + samples * w
        state = np.hstack([_root(steady), np.zeros((n + k, samples * w))])
        self._x_hat = state[n:]
        self._y, self._u = [], []
        for sample in range(samples):
            white = np.zeros((w, size))
            white[:, n + k + sample * w : n + k + (sample + 1) * w] = np.eye(w)
            self._y.append(C_y @ state[:n] + D_y @ white)
            self._u.append(C_u @ state[:n] + D_u @ white)
            state = A @ state + B @ white

    def without_pairs(self, missing: int) -> Array:
        """RMS of what is added to d_hat when gyro and moment of samples 1 … `missing` do not come."""
        end = missing + 1
        rates, held = self._bridged(end), self._u[0]
        return self._added([(rates[k] - self._y[k], held - self._u[k]) for k in range(end)])

    def without_moments(self, missing: int) -> Array:
        """The largest RMS of what is added to d_hat when the moments of samples 1 … `missing` do not come: until the
        next one does, or after it has, when the rates are used after all and HELD moments or more lie on a line."""
        before, after = self._u[0], self._u[missing + 1]
        known = [
            (0.0 * self._y[k], before + (after - before) * k / (missing + 1) - self._u[k]) for k in range(missing + 1)
        ]
        if missing < HELD:
            known = [(0.0 * self._y[k], before - self._u[k]) for k in range(missing + 1)]
        return np.maximum(self._until(missing), self._added(known))

    def _until(self, missing: int) -> Array:
        """The largest RMS at samples 2 … `missing` + 1, before the next moment comes."""
        p, held, x = self._predictor, self._u[0], np.zeros((len(self._observer.A), self._y[0].shape[1]))
        D_y = self._observer.D[:, : len(self._y[0])]
        x_hat, rates, largest = self._x_hat, self._y[0], np.zeros(len(self._observer.C))
        for k in range(missing + 1):
            x = self._observer.A @ x + self._observer.B @ np.vstack([rates - self._y[k], held - self._u[k]])
            x_hat = p.A @ x_hat + p.B @ held + p.K @ (rates - p.C @ x_hat - p.D @ held)
            rates = self._y[k + 1] if k + 1 <= HELD else p.C @ x_hat + p.D @ held
            d_hat = self._observer.C @ x + D_y @ (rates - self._y[k + 1])
            largest = np.maximum(largest, np.linalg.norm(d_hat, axis=1))
        return largest

    def _added(self, errors: list[tuple[Array, Array]]) -> Array:
        """The largest RMS of d_hat's difference at the samples after inputs that were off by (rates, moments)."""
        x = np.zeros((len(self._observer.A), self._y[0].shape[1]))
        for rates, moments in errors:
            x = self._observer.A @ x + self._observer.B @ np.vstack([rates, moments])
        return np.asarray(np.max(np.linalg.norm(self._afterwards @ x, axis=2), axis=0))

    def _bridged(self, end: int) -> list[Array]:
        """The rates of samples 0 … end as they are put in when those between do not come."""
        p, held = self._predictor, self._u[0]
        x = p.A @ self._x_hat + p.B @ held + p.K @ (self._y[0] - p.C @ self._x_hat - p.D @ held)
        foreseen = []
        for _ in range(end):
            foreseen.append(p.C @ x + p.D @ held)
            x = p.A @ x + p.B @ held
        surprise = self._y[end] - foreseen[-1]
        return [self._y[0]] + [y + W @ surprise for y, W in zip(foreseen, self._bridges[end], strict=True)]


def _root(P: Array) -> Array:
    """R with R R' = P, for P symmetric and positive semidefinite up to rounding. States of very different sizes keep
    their digits: eigenvalues are those of the correlations."""
    size = np.sqrt(np.maximum(np.diag(P), 0.0))
    unit = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(P / np.outer(unit, unit))
    return np.asarray(unit[:, None] * (vectors * np.sqrt(np.maximum(values, 0.0))))

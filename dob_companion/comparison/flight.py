"""The same weather for every observer, flown in time and computed in expectation.

Disturbance: white noise through a first-order 1 Hz low-pass (the paper's Section IV), scaled for each seed so that
the attitude error peaks at the paper's value with the observer off. Gyro noise: white, -68 dBW (its Fig. 14).
Each flight begins from rest; as in result.json the mean is removed before RMS and peak are taken. The simulation is
linear: the moments stay far from saturation.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.comparison.vehicle import OUTPUTS, Vehicle, close, no_observer
from dob_companion.errors import NotConvergedError
from dob_companion.lti.gramian import gramian
from dob_companion.lti.response import STABLE, spectral_radius

Array = NDArray[np.float64]

DISTURBANCE_HZ = 1.0
"""Corner of the disturbance's low-pass, Section IV of the paper."""

NOISE_SIGMA = 10.0 ** (-68.0 / 20.0)
"""Standard deviation of the gyro noise, rad/s: -68 dBW, the paper's Fig. 14."""

PEAKS_OFF = {"roll": 0.15, "pitch": 0.12, "yaw": 0.12}
"""Peak attitude error with the observer off, rad, Section IV of the paper."""

FLIGHT_S = 60.0

SCALINGS, NEAR = 200, 1e-12
"""Steps at most of the search for the disturbance's size, and how near the peak is to its value then."""


@dataclass(frozen=True, slots=True, eq=False)
class Weather:
    """Disturbance d (normalized torque) and noise n (rad/s), (samples, seeds); `scale` is d's sigma, one per seed."""

    d: Array
    n: Array
    scale: Array

    @property
    def typical_scale(self) -> float:
        """One sigma for all seeds, of the same mean power."""
        return float(np.sqrt(np.mean(self.scale**2)))


def disturbance_pole(dt: float, hertz: float = DISTURBANCE_HZ) -> float:
    """Pole of the sampled first-order low-pass."""
    return float(np.exp(-2.0 * np.pi * hertz * dt))


def make_weather(vehicle: Vehicle, peak_off: float, seeds: int) -> Weather:
    """Weather of seeds 0 … seeds-1 for a vehicle whose loop is stable with the observer off.

    Raises NotConvergedError when no disturbance gives the peak, as when the noise alone goes beyond it.
    """
    count = round(FLIGHT_S / vehicle.dt)
    white = np.stack([np.random.default_rng(seed).standard_normal((count, 2)) for seed in range(seeds)], axis=1)
    a = disturbance_pole(vehicle.dt)
    d, level = np.zeros((count, seeds)), np.zeros(seeds)
    for k in range(count):
        d[k] = level
        level = a * level + np.sqrt(1.0 - a * a) * white[k, :, 0]
    n = NOISE_SIGMA * white[:, :, 1]
    off = close(vehicle, no_observer(vehicle.dt))
    from_d, from_n = attitude(off, d, np.zeros_like(n)), attitude(off, np.zeros_like(d), n)
    scale = np.full(seeds, peak_off) / np.max(np.abs(from_d), axis=0)
    for _ in range(SCALINGS):  # the noise moves the peak a little: a fixed point
        share = peak_off / np.max(np.abs(scale * from_d + from_n), axis=0)
        scale = scale * share
        if np.all(np.abs(share - 1.0) <= NEAR):
            return Weather(scale * d, n, scale)
    raise NotConvergedError(
        f"no disturbance makes the attitude error peak at {peak_off:g} rad with the observer off; noise alone makes it "
        f"peak at up to {np.max(np.abs(from_n)):.3g} rad"
    )


def attitude(loop: Any, d: Array, n: Array) -> Array:
    """Attitude error, rad, mean removed, (samples, seeds), from rest; all seeds at once."""
    A, B, row = loop.A, loop.B, OUTPUTS.index("theta")
    c, e = loop.C[row], loop.D[row]
    w = np.stack([d, n], axis=1)
    x = np.zeros((len(A), d.shape[1]))
    theta = np.empty_like(d)
    for k in range(len(d)):
        theta[k] = c @ x + e @ w[k]
        x = A @ x + B @ w[k]
    return np.asarray(theta - np.mean(theta, axis=0))


def rms(values: Array) -> Array:
    """Root mean square of each column."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))


@dataclass(frozen=True, slots=True)
class Expected:
    """Steady-state standard deviations: attitude error (rad), and the correction that noise alone causes."""

    attitude: float
    noise_in_correction: float


def expect(loop: Any, scale: float) -> Expected | None:
    """What flights of disturbance sigma `scale` come to on average, by Lyapunov equations; None when unstable."""
    if spectral_radius(loop.A) >= STABLE:
        return None
    n, a = len(loop.A), disturbance_pole(loop.dt)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[:n, n], A[n, n] = loop.A, loop.B[:, 0], a
    excited = np.zeros((n + 1, 1))
    excited[n] = scale * np.sqrt(1.0 - a * a)
    by_wind, by_noise = gramian(A, excited), gramian(loop.A, loop.B[:, 1:] * NOISE_SIGMA)

    def variance(name: str, P: Array, direct: float) -> float:
        row = OUTPUTS.index(name)
        c = np.append(loop.C[row], loop.D[row, 0])[: len(P)]
        return float(c @ P @ c + (direct * loop.D[row, 1]) ** 2)

    theta = variance("theta", by_wind, 0.0) + variance("theta", by_noise, NOISE_SIGMA)
    return Expected(float(np.sqrt(theta)), float(np.sqrt(variance("d_hat", by_noise, NOISE_SIGMA))))

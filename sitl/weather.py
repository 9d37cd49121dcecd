"""Disturbance and gyro noise: one seeded generator, drawn in blocks, restarted where a comparison needs it."""

from math import exp, pi, sqrt

import numpy as np
from scipy.signal import lfilter

from sitl.attitude import ZERO, Vector
from sitl.dynamics import DT

BLOCK = 1024

CALM, SEGMENT = 0, 1
"""Streams of one seed: before the comparison begins, and the two segments that share their sequences."""


def noise_sigma(power_dbw: float) -> float:
    """Standard deviation of white noise with this power: −68 dBW is 3.98e-4 (rad/s for a gyro; paper, Fig. 14)."""
    return sqrt(10.0 ** (power_dbw / 10.0))


def first_order_pole(bandwidth_hz: float, dt: float = DT) -> float:
    """Pole of a sampled first-order low-pass with this −3 dB frequency: exp(−2π f dt)."""
    return exp(-2.0 * pi * bandwidth_hz * dt)


class Weather:
    """White Gaussian gyro noise, and disturbance torque = white noise through a first-order low-pass, per axis.

    The low-pass is normalized to unit variance in the steady state and starts from zero; `scale` (normalized torque,
    roll, pitch, yaw) is then the disturbance's standard deviation. The paper says "filtering a serial of random value
    with a low pass filter (1 Hz cutoff frequency)" (Section IV); that the filter is of first order is a guess.

    The generator is drawn row by row as d (3), n (3), so the block size does not show in the sequences.
    """

    def __init__(self, seed: int, bandwidth_hz: float, scale: Vector, sigma: float) -> None:
        self._seed = seed
        self._pole = first_order_pole(bandwidth_hz)
        self._scale = np.array(scale)
        self._sigma = sigma
        self.begin(CALM)

    def begin(self, stream: int) -> None:
        """Start a stream from its first sample; `CALM` has no disturbance."""
        self._calm = stream == CALM
        self._rng = np.random.default_rng([self._seed, stream])
        self._memory = np.zeros((1, 3))
        self._rows: list[list[float]] = []
        self._next = 0

    def sample(self) -> tuple[Vector, Vector]:
        """Disturbance (normalized torque) and gyro noise (rad/s) of the next sample."""
        if self._next == len(self._rows):
            self._draw()
        d0, d1, d2, n0, n1, n2 = self._rows[self._next]
        self._next += 1
        return (ZERO if self._calm else (d0, d1, d2)), (n0, n1, n2)

    def _draw(self) -> None:
        white = self._rng.standard_normal((BLOCK, 6))
        gain = sqrt(1.0 - self._pole**2)
        d, self._memory = lfilter([0.0, gain], [1.0, -self._pole], white[:, :3], axis=0, zi=self._memory)
        self._rows = np.hstack([d * self._scale, white[:, 3:] * self._sigma]).tolist()
        self._next = 0

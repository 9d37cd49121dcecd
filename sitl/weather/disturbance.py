"""Disturbance and gyro noise: one seeded generator, drawn in blocks, restarted where a comparison needs it."""

from math import exp, pi, sqrt

import numpy as np

from sitl.attitude import ZERO, Vector
from sitl.constants import DT

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

    The generator is drawn row by row as d (3), n (3), so the block size does not show in the sequences. `calm` is true
    in the stream without disturbance.
    """

    def __init__(self, seed: int, bandwidth_hz: float, scale: Vector, sigma: float) -> None:
        self._seed = seed
        self._pole = first_order_pole(bandwidth_hz)
        gain = sqrt(1.0 - self._pole**2)
        self._size = np.array([gain * scale[0], gain * scale[1], gain * scale[2], sigma, sigma, sigma])
        self.begin(CALM)

    def begin(self, stream: int) -> None:
        """Start a stream from its first sample; `CALM` has no disturbance."""
        self.calm = stream == CALM
        self._rng = np.random.default_rng([self._seed, stream])
        self._disturbance = ZERO
        self._rows: list[list[float]] = []
        self._next = 0

    def sample(self) -> tuple[Vector, Vector]:
        """Disturbance (normalized torque) and gyro noise (rad/s) of the next sample."""
        if self._next == len(self._rows):
            self._rows = (self._rng.standard_normal((BLOCK, 6)) * self._size).tolist()
            self._next = 0
        w0, w1, w2, n0, n1, n2 = self._rows[self._next]
        self._next += 1
        d = self._disturbance
        if not self.calm:
            a = self._pole
            self._disturbance = (a * d[0] + w0, a * d[1] + w1, a * d[2] + w2)
        return d, (n0, n1, n2)

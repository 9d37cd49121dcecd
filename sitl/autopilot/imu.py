"""The gyro between the body's rate and the controller, and the clock that stamps its samples. Pure."""

from dataclasses import dataclass, field
from math import floor

import numpy as np

from sitl.attitude import ZERO, Vector

FINE = 4000.0 / 2**20 * 0.017453292519943295
"""Step of a gyro with 20 bits over ±2000 °/s, rad/s: the high-resolution FIFO of the ICM-42688-P (its data sheet)."""

COARSE = 4000.0 / 2**16 * 0.017453292519943295
"""Step of a gyro with 16 bits over ±2000 °/s, rad/s: MPU-6000 and its successors (their data sheets)."""


@dataclass(slots=True)
class Gyro:
    """Bias, latency and quantization; white noise comes in with each sample. Mutable: events change it in flight.

    `bias` in rad/s; `latency` in samples, whole and part, linear in between; `quantum` is the step of the reading,
    rad/s, 0 for none.

    Limits: no scale error, no axis misalignment, no saturation, no bias drift.
    """

    bias: Vector = ZERO
    latency: float = 0.0
    quantum: float = 0.0
    _past: list[Vector] = field(default_factory=list)

    def read(self, rate: Vector, noise: Vector) -> Vector:
        """What the gyro says while the body turns at `rate`; one call per sample, all rad/s, hover axes."""
        if self.latency > 0.0 or self._past:
            rate = self._late(rate)
        x, y, z = rate[0] + noise[0], rate[1] + noise[1], rate[2] + noise[2]
        if self.bias is not ZERO:
            a, b, c = self.bias
            x, y, z = x + a, y + b, z + c
        if self.quantum > 0.0:
            q = self.quantum
            return q * round(x / q), q * round(y / q), q * round(z / q)
        return x, y, z

    def _late(self, rate: Vector) -> Vector:
        whole = floor(self.latency)
        part = self.latency - whole
        past = self._past
        past.insert(0, rate)
        del past[whole + 2 :]
        new = past[min(whole, len(past) - 1)]
        old = past[min(whole + 1, len(past) - 1)]
        return (
            new[0] + part * (old[0] - new[0]),
            new[1] + part * (old[1] - new[1]),
            new[2] + part * (old[2] - new[2]),
        )


class Stamps:
    """Time stamps as autopilots make them, µs, from the vehicle's exact time.

    `grid_us` is the period of the loop that takes the sample: with 2500 (a 400 Hz loop asked for 250 Hz) stamps step by
    2.5 and 5 ms in turn. `jitter_us` is the standard deviation of the time at which a sample is stamped late or early;
    `skew_ppm` the rate error of the clock, parts per million (4000 was seen). Stamps always increase.

    Limits: the value stamped is still the one of the exact time.
    """

    def __init__(self, seed: int, *, grid_us: int = 0, jitter_us: float = 0.0, skew_ppm: float = 0.0) -> None:
        self._grid, self._jitter, self._skew = grid_us, jitter_us, 1e-6 * skew_ppm
        self._rng = np.random.default_rng([seed, 3])  # a stream of its own beside the weather's
        self._last = -1

    def stamp(self, now_us: int) -> int:
        """Stamp of the sample taken at `now_us`; one call per sample."""
        t = now_us
        if self._grid:
            t -= t % self._grid
        late = self._jitter * self._rng.standard_normal() if self._jitter else 0.0
        self._last = max(self._last + 1, round(t * (1.0 + self._skew) + late))
        return self._last

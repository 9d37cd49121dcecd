"""Smooth spectra of disturbances: an observer that is the best in a band with sharp edges is poor beside it.

Each is a power density over angle (rad per sample) up to a factor; its RMS is stated apart.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Shape(Protocol):
    """A spectrum up to a factor."""

    def density(self, angles: Array, dt: float) -> Array:
        """Power density, any unit, at angles in rad per sample, 0 < angle <= pi; dt in s."""
        ...

    @property
    def words(self) -> str:
        """As in "disturbances …"."""
        ...


@dataclass(frozen=True, slots=True)
class LowPass:
    """White noise through a sampled first-order low-pass."""

    corner_hz: float

    def density(self, angles: Array, dt: float) -> Array:
        """|1 / (z - a)|^2, a = exp(-2 pi corner dt)."""
        a = np.exp(-2.0 * np.pi * self.corner_hz * dt)
        return np.asarray(1.0 / np.abs(np.exp(1j * angles) - a) ** 2)

    @property
    def words(self) -> str:
        """In words."""
        return f"through a {self.corner_hz:g} Hz low-pass"


@dataclass(frozen=True, slots=True)
class Band:
    """Flat from low to high, with second-order edges (40 dB a decade)."""

    low_hz: float
    high_hz: float

    def density(self, angles: Array, dt: float) -> Array:
        """1 / ((1 + (low/f)^4) (1 + (f/high)^4))."""
        f = angles / (2.0 * np.pi * dt)
        return np.asarray(1.0 / ((1.0 + (self.low_hz / f) ** 4) * (1.0 + (f / self.high_hz) ** 4)))

    @property
    def words(self) -> str:
        """In words."""
        return f"of {self.low_hz:g} to {self.high_hz:g} Hz"


@dataclass(frozen=True, slots=True)
class Dryden:
    """Gusts across the mean wind, MIL-F-8785C: (1 + 3 (L w/V)^2) / (1 + (L w/V)^2)^2, wind V in m/s, length L in m.

    The vehicle hovers and the air is carried past it; the moment is taken as proportional to the gust.
    """

    wind_m_s: float
    length_m: float

    @property
    def corner_hz(self) -> float:
        """V / (2 pi L)."""
        return self.wind_m_s / (2.0 * np.pi * self.length_m)

    def density(self, angles: Array, dt: float) -> Array:
        """Of the gust's speed, hence of the moment."""
        s = (angles / dt * self.length_m / self.wind_m_s) ** 2
        return np.asarray((1.0 + 3.0 * s) / (1.0 + s) ** 2)

    @property
    def words(self) -> str:
        """In words."""
        return f"of Dryden gusts, {self.wind_m_s:g} m/s and {self.length_m:g} m"


@dataclass(frozen=True, slots=True)
class Measured:
    """A table: power density at rising frequencies in Hz, straight between them on logarithmic scales.

    Below the first frequency it stays level, above the last one it falls by 40 dB a decade.
    """

    hz: tuple[float, ...]
    power: tuple[float, ...]

    def density(self, angles: Array, dt: float) -> Array:
        """Interpolated."""
        f = angles / (2.0 * np.pi * dt)
        inside = np.exp(np.interp(np.log(f), np.log(self.hz), np.log(self.power)))
        return np.asarray(inside * np.minimum(1.0, self.hz[-1] / f) ** 4)

    @property
    def words(self) -> str:
        """In words."""
        return f"of the measured spectrum, {self.hz[0]:g} to {self.hz[-1]:g} Hz"

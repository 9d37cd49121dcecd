"""Is the plant still the one designed for? A loop around another plant rings, and so does the innovation.

The design's own model (`observer.StrongWind`, a steady-state Kalman predictor) foresees each gyro sample from the
applied moment. With the right plant the innovation is nearly white, also in strong wind; what a loop does that nears
instability because the plant is another one was not foreseen.

It is looked at twice. Half-waves (`half_waves`) find an oscillation while it grows, within two periods. The
autocorrelation of the last second finds one that has come to stay, however it came.
(R. K. Mehra, On the identification of variances and adaptive Kalman filtering, IEEE TAC 15(2), 1970.)
"""

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import AXES
from dob_companion.lti.filters import butterworth
from dob_companion.lti.statespace import beside, series
from dob_companion.supervisor.half_waves import HalfWaves

Vector = NDArray[np.float64]
Axes3 = tuple[float, float, float]

WINDOW_S = 1.0
RINGING = 0.8
RINGING_HZ = (5.0, 31.0)
LEAST_INNOVATION = 0.02
"""An innovation of more than so many rad/s, root mean square, that repeats itself at these frequencies (autocorrelation
above RINGING after a period, below -RINGING after half of one) is a loop that rings, whatever the wind does."""

BAND_HZ = (4.0, 40.0)
"""Half-waves are counted within this band: without offsets, and without the noise that would add crossings of zero."""


class Innovation:
    """What the model did not foresee of each gyro sample, and whether it rings. Axes are roll, pitch, yaw."""

    def __init__(self, dt: float) -> None:
        band = series(*(butterworth(dt, hz, high_pass=hz == BAND_HZ[0]) for hz in reversed(BAND_HZ)))
        self._A, self._B, self._C, self._D = beside(band, band, band)
        self._recent = np.zeros((round(WINDOW_S / dt), 3))
        shortest, longest = (round(1.0 / (hz * dt)) for hz in reversed(RINGING_HZ))
        self._periods = np.arange(shortest, longest + 1)
        self._half_waves = tuple(HalfWaves(dt) for _ in AXES)
        self._x = np.zeros(len(self._A))
        self._at = 0

    def clear(self) -> None:
        """The samples start anew."""
        self._x[:] = 0.0
        self._recent[:] = 0.0
        for axis in self._half_waves:
            axis.clear()

    def add(self, innovation: Axes3, u_e: Axes3, correction: Axes3) -> str:
        """One sample: innovation (rad/s), applied moment and our part in it (normalized torque).

        Returns the axis on which an oscillation grows that we drive, in words; "" when none does.
        """
        e = np.array(innovation)
        band = (self._C @ self._x + self._D @ e).tolist()
        self._x = self._A @ self._x + self._B @ e
        self._recent[self._at] = e
        self._at = (self._at + 1) % len(self._recent)
        grows = [*map(HalfWaves.add, self._half_waves, band, u_e, correction)]
        return _rings(grows.index(True)) if True in grows else ""

    def why_not(self) -> str:
        """The axis that has been ringing for a second, in words; "" when none has."""
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
        return _rings(int(loud[np.argmax(rings)])) if np.any(rings) else ""


def _rings(axis: int) -> str:
    return f"{AXES[axis]} rings: not the plant designed for"

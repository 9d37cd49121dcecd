"""Frequency response of a plant inside a closed loop, from what was injected, what went in and what came out. Pure.

The gyro's noise runs through the controller into u_e, so u_e and the noise are correlated, and the usual
S_uy / S_uu is drawn towards −1/C where noise rules. The injected signal r is correlated with neither noise nor wind:
G = S_ry / S_ru is free of that bias (the joint input-output, or instrumental variable, estimate: P. Wellstead,
"Non-parametric methods of system identification", Automatica 17 (1981); Ljung, *System Identification*, 2nd ed. 1999,
on closed loops; Pintelon and Schoukens 2012; Tischler and Remple, *Aircraft and Rotorcraft System Identification*,
2nd ed. AIAA 2012, on identification with the stability augmentation on).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sitl.constants import DT
from sitl.sweep.multisine import Floats, Lines

Complexes = NDArray[np.complex128]

SMOOTHED = 5
"""The variance is averaged over this many neighbouring lines: one line has only as many as there are realizations."""


@dataclass(frozen=True, slots=True)
class Response:
    """An estimated frequency response over L lines.

    `frequency` in rad/s; `value` in output per input; `deviation` is the standard deviation of the complex `value`,
    √E|error|²; `coherence_u` and `coherence_y` are the squared coherences of the injected signal with input and output.
    """

    frequency: Floats
    value: Complexes
    deviation: Floats
    coherence_u: Floats
    coherence_y: Floats


def frequency_response(r: Floats, u: Floats, y: Floats, lines: Lines, dt: float = DT) -> Response:
    """Response from u to y with r as reference, each of shape (realizations, period): at least two realizations.

    The residual y − Ĝu of each realization holds noise and nonlinear distortion alike; var Ĝ = S_ee S_rr / (n |S_ru|²).
    """
    n, period = r.shape
    if n < 2:
        raise ValueError(f"{n} realization; expected at least 2, or there is no variance")
    R, U, Y = (np.fft.rfft(signal, axis=1)[:, lines] / period for signal in (r, u, y))
    S_rr, S_uu, S_yy = (_power(signal) for signal in (R, U, Y))
    S_ru, S_ry = (np.mean(signal * R.conj(), axis=0) for signal in (U, Y))
    value = S_ry / S_ru
    S_ee = _smooth(np.sum(np.abs(Y - value * U) ** 2, axis=0) / (n - 1))
    return Response(
        frequency=2.0 * np.pi * lines / (period * dt),
        value=value,
        deviation=np.sqrt(S_ee * S_rr / n) / np.abs(S_ru),
        coherence_u=np.abs(S_ru) ** 2 / (S_rr * S_uu),
        coherence_y=np.abs(S_ry) ** 2 / (S_rr * S_yy),
    )


def _power(signal: Complexes) -> Floats:
    return np.asarray(np.mean(np.abs(signal) ** 2, axis=0))


def _smooth(values: Floats) -> Floats:
    """Moving average over `SMOOTHED` lines, fewer at the ends."""
    window = np.ones(min(SMOOTHED, len(values)))
    return np.convolve(values, window, "same") / np.convolve(np.ones_like(values), window, "same")

"""The paper's model fitted to a frequency response: G(z) = gain (z − zero) / ((z − 1)(z − pole)). Pure.

Complex least squares on the relative error, so that every line of the band counts alike unless noise makes it worth
less: with weights of noise alone a handful of very clean lines would decide, and a model whose form is a little too
poor would be right there and wrong elsewhere. It starts from the linear problem that multiplying by the denominator
gives (Levy, "Complex-curve fitting", IRE Trans. AC-4 (1959)), so that nothing has to be guessed.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from sitl.airframe.linear import RateAxis
from sitl.constants import DT
from sitl.sweep.estimate import Complexes, Response
from sitl.sweep.multisine import Floats

BAND = (4.0, 50.0)
"""Where the paper fits, rad/s (its Fig. 6)."""


FORM = 0.01
"""Relative error that the form of the model is granted in the weights: lines known better than this count alike."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted model and how well it is known.

    `deviation` holds the standard deviations of the model's numbers that the response's own leave, widened by √`chi2`
    where that is above 1. `chi2` is the mean square of the misfits over what noise explains: near 1 where noise is all
    that is left, larger where the form of the model is too poor for the precision of the data. `worst` is the largest
    relative misfit |Ĝ/G − 1| in `band`, rad/s.
    """

    model: RateAxis
    deviation: RateAxis
    chi2: float
    worst: float
    band: tuple[float, float]


def response_of(model: RateAxis, frequency: Floats, dt: float = DT) -> Complexes:
    """G(e^{jω dt}) at these frequencies, rad/s."""
    z = np.exp(1j * frequency * dt)
    return np.asarray(model.gain * (z - model.zero) / ((z - model.slow) * (z - model.pole)))


def fit_rate_axis(
    response: Response, band: tuple[float, float] = BAND, *, integrator: bool = True, dt: float = DT
) -> Fit:
    """Fit over `band`, rad/s; the slow pole is 1, or free if it is no `integrator`.

    Raises ValueError when fewer than four lines lie in the band.
    """
    inside = (response.frequency >= band[0]) & (response.frequency <= band[1])
    if np.count_nonzero(inside) < 4:
        raise ValueError(f"{np.count_nonzero(inside)} lines from {band[0]:g} to {band[1]:g} rad/s; expected at least 4")
    w, value, deviation = response.frequency[inside], response.value[inside], response.deviation[inside]
    granted = np.hypot(deviation, FORM * np.abs(value))

    def residual(p: Floats) -> Floats:
        return _stack((response_of(RateAxis(*p), w, dt) - value) / granted)

    start = _levy(w, value, granted, integrator, dt)
    found = least_squares(residual, start, x_scale="jac", method="lm", xtol=1e-14, ftol=1e-14)
    model = RateAxis(*found.x.tolist())
    misfit = response_of(model, w, dt) - value
    # Each complex misfit is two numbers, each with half of its variance.
    chi2 = float(2.0 * np.sum(np.abs(misfit / deviation) ** 2) / (2 * len(w) - len(found.x)))
    noise = np.tile(deviation / granted, 2) / np.sqrt(2.0)
    spread = np.linalg.pinv(np.asarray(found.jac)) * noise * np.sqrt(max(chi2, 1.0))
    return Fit(
        model=model,
        deviation=RateAxis(*_padded(np.sqrt(np.sum(spread**2, axis=1)))),
        chi2=chi2,
        worst=float(np.abs(value / response_of(model, w, dt) - 1.0).max()),
        band=band,
    )


def _padded(deviations: Floats) -> list[float]:
    """Deviations of gain, zero, pole and slow pole: one that was not fitted has none."""
    return [*deviations.tolist(), 0.0][:4]


def _levy(frequency: Floats, value: Complexes, deviation: Floats, integrator: bool, dt: float) -> Floats:
    """Starting values, from the problem that is linear in the coefficients of numerator and denominator.

    With an integrator (z − 1)(z − pole) G = gain z − gain zero, otherwise (z² + a z + b) G = gain z − gain zero.
    """
    z = np.exp(1j * frequency * dt)
    weight = 1.0 / (np.abs(z - 1.0) * np.abs(z - 0.9) * deviation)  # the error of G is multiplied by the denominator
    known = (z - 1.0) * z if integrator else z**2
    unknown = [z - 1.0] if integrator else [z, np.ones_like(z)]
    columns = np.array([z, np.ones_like(z), *(-value * factor for factor in unknown)]) * weight
    (gain, constant, *a), *_ = np.linalg.lstsq(_stack(columns).T, _stack(known * value * weight))
    poles = [-a[0]] if integrator else np.sort(np.roots([1.0, *a]).real).tolist()
    return np.array([gain, -constant / gain, *poles])


def _stack(values: Complexes) -> Floats:
    """Real parts beside imaginary parts, along the last axis."""
    return np.concatenate([values.real, values.imag], axis=-1)

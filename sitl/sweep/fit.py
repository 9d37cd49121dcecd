"""The paper's model fitted to a frequency response: G(z) = gain (z − zero) / ((z − 1)(z − pole)). Pure.

Complex least squares, each line weighted by its own deviation: the maximum likelihood estimate for independent circular
Gaussian errors (Pintelon and Schoukens 2012). It starts from the linear problem that multiplying by the denominator
gives (Levy, "Complex-curve fitting", IRE Trans. AC-4 (1959)), so that nothing has to be guessed.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from sitl.dynamics import DT, RateAxis
from sitl.sweep.estimate import Complexes, Response
from sitl.sweep.multisine import Floats

BAND = (4.0, 50.0)
"""Where the paper fits, rad/s (its Fig. 6)."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted model and how well it is known.

    `deviation` holds the standard deviations of gain, zero and pole, widened by √`chi2` where that is above 1. `chi2`
    is the sum of squared weighted residuals per degree of freedom: near 1 where noise is all that is left, larger where
    the model's form is too poor for the precision of the data. `worst` is the largest misfit |Ĝ/G − 1| in `band`.
    """

    model: RateAxis
    deviation: RateAxis
    chi2: float
    worst: float
    band: tuple[float, float]


def response_of(model: RateAxis, frequency: Floats, dt: float = DT) -> Complexes:
    """G(e^{jω dt}) at these frequencies, rad/s."""
    z = np.exp(1j * frequency * dt)
    return np.asarray(model.gain * (z - model.zero) / ((z - 1.0) * (z - model.pole)))


def fit_rate_axis(response: Response, band: tuple[float, float] = BAND, dt: float = DT) -> Fit:
    """Fit over `band`, rad/s. Raises ValueError when fewer than four lines lie in it."""
    inside = (response.frequency >= band[0]) & (response.frequency <= band[1])
    if np.count_nonzero(inside) < 4:
        raise ValueError(f"{np.count_nonzero(inside)} lines from {band[0]:g} to {band[1]:g} rad/s; expected at least 4")
    w, value, deviation = response.frequency[inside], response.value[inside], response.deviation[inside]
    scale = np.sqrt(2.0) / deviation  # a circular error has half its variance in each of its two parts

    def residual(p: Floats) -> Floats:
        return _stack((response_of(RateAxis(*p), w, dt) - value) * scale)

    found = least_squares(residual, _levy(w, value, deviation, dt), x_scale="jac", method="lm", xtol=1e-14, ftol=1e-14)
    chi2 = 2.0 * found.cost / (len(found.fun) - len(found.x))
    jacobian = np.asarray(found.jac)
    covariance = np.linalg.inv(jacobian.T @ jacobian) * max(chi2, 1.0)
    model = RateAxis(*found.x.tolist())
    return Fit(
        model=model,
        deviation=RateAxis(*np.sqrt(np.diag(covariance)).tolist()),
        chi2=float(chi2),
        worst=float(np.abs(value / response_of(model, w, dt) - 1.0).max()),
        band=band,
    )


def _levy(frequency: Floats, value: Complexes, deviation: Floats, dt: float) -> Floats:
    """gain, zero, pole from (z − 1) z G = pole (z − 1) G + gain z − gain zero, linear in the unknowns."""
    z = np.exp(1j * frequency * dt)
    weight = 1.0 / (np.abs(z - 1.0) * np.abs(z - 0.9) * deviation)  # the error of G is multiplied by the denominator
    columns = np.array([(z - 1.0) * value, z, np.ones_like(z)]) * weight
    (pole, gain, constant), *_ = np.linalg.lstsq(_stack(columns).T, _stack((z - 1.0) * z * value * weight), rcond=None)
    return np.array([gain, -constant / gain, pole])


def _stack(values: Complexes) -> Floats:
    """Real parts beside imaginary parts, along the last axis."""
    return np.concatenate([values.real, values.imag], axis=-1)

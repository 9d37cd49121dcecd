"""Incremental nonlinear dynamic inversion as an add-on to the baseline controller.

Source: E. J. J. Smeur, Q. Chu, G. C. H. E. de Croon, "Adaptive incremental nonlinear dynamic inversion for attitude
control of micro air vehicles", J. Guidance, Control, and Dynamics 39(3), 2016:

    u_c = u_f + (ν - ω̇_f) / g

ω̇_f is the differenced rate behind a second-order filter H, u_f the actuator's state behind the same H (and delayed
alike), g the control effectiveness. With the baseline controller asking for ν = g u this is u_c = u - d_hat,

    d_hat = H (ω̇ / g - actuator(u_e)),

which is how it stands here. The model that it needs is read off the plant: g, a first-order actuator of the plant's
dominant lag, and whole samples of delay for the rest. INDI measures accelerations, so it sees a disturbance that
enters before the actuator's lag only behind that lag.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dob_companion.comparison.rational import (
    NotApplicableError,
    low_passed,
    observer_from,
    power,
    product,
    roots_of,
)

INTEGRATING = 0.9
"""The rate must integrate its acceleration: the plant's slowest pole is at least here."""


@dataclass(frozen=True, slots=True)
class ActuatorModel:
    """Acceleration = effectiveness * z^-delay * (1 - pole) / (z - pole) u: rad/s² per normalized torque."""

    effectiveness: float
    pole: float
    delay: int


def actuator_model(plant: Any) -> ActuatorModel:
    """What INDI knows of a plant. Raises NotApplicableError when its rate does not integrate a moment."""
    g = roots_of(plant)
    slowest = int(np.argmin(np.abs(g.poles - 1.0)))
    rest = np.delete(g.poles, slowest)
    if abs(g.poles[slowest].imag) > 1e-9 or g.poles[slowest].real < INTEGRATING:
        raise NotApplicableError("INDI needs a plant whose rate integrates the moment")
    zeros = np.concatenate([g.inner, g.outer])
    effectiveness = float(np.real(g.gain * np.prod(1.0 - zeros) / np.prod(1.0 - rest))) / float(plant.dt)
    lags = sorted(p.real for p in rest if abs(p.imag) < 1e-9 and 0.0 < p.real < 1.0)
    pole = lags[-1] if lags else 0.0
    # Mean delay (at frequency 0) of (z - 1) / z G beside that of the lag: Σ 1/(1-p) - Σ 1/(1-z), p = 0 from 1/z.
    late = 1.0 + np.sum(1.0 / (1.0 - rest)).real - np.sum(1.0 / (1.0 - zeros)).real - 1.0 / (1.0 - pole)
    return ActuatorModel(effectiveness, pole, max(round(float(late)), 0))


def indi(plant: Any, hertz: float) -> Any:
    """D(z) with a second-order Butterworth H of this -3 dB frequency."""
    model, dt = actuator_model(plant), float(plant.dt)
    lag = np.array([1.0, -model.pole])
    rate = np.array([1.0, -1.0]) / (dt * model.effectiveness)  # over z: the rate differenced
    below = max(model.delay, 1)
    measured, expected = product(rate, lag, power(below - 1)), (1.0 - model.pole) * power(below - model.delay)
    return low_passed(observer_from(measured, -expected, product(lag, power(below)), dt), 2, hertz)

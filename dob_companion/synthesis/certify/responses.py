"""Frequency responses of a design, as the paper plots them (its Figs. 7 to 10), for one axis or several."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import DobBlock, StateSpaceData
from dob_companion.lti.response import response
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import from_data

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Responses:
    """Complex responses of shape (frequencies, outputs, inputs); m moments, p rates.

    Q, G_n_inverse            the standard observer d_hat = Q (G_n^-1 y_n - u_e): -D_u (m, m) and -D_u^-1 D_y (m, p)
    G, G_inverse              the plant (p, m) and its inverse (pseudo-inverse when not square)   Fig. 7
    d_to_estimate             d -> d_hat                                                          Fig. 8
    d_to_rate_off, _on        d -> y, rad/s per normalized torque                                 Fig. 9
    n_to_estimate             n -> d_hat                                                          Fig. 10
    error                     d -> d - z^-tau d_hat: T_f of eq. (2)
    disturbance_weight, noise_weight  W_d and W_n of eq. (13)
    """

    frequency_hz: Array
    Q: ComplexArray
    G_n_inverse: ComplexArray
    G: ComplexArray
    G_inverse: ComplexArray
    d_to_estimate: ComplexArray
    d_to_rate_off: ComplexArray
    d_to_rate_on: ComplexArray
    n_to_estimate: ComplexArray
    error: ComplexArray
    disturbance_weight: ComplexArray
    noise_weight: ComplexArray


def default_frequencies(dt: float, count: int = 600) -> Array:
    """Logarithmic, from 0.1 Hz (as in the paper) or a thousandth of the rate, up to half the rate, in Hz."""
    return np.geomspace(min(0.1, 1e-3 / dt), 0.5 / dt, count)


def block_responses(block: DobBlock, dt: float, frequency_hz: Array | None = None) -> Responses:
    """All responses of one block at frequencies in Hz (default: `default_frequencies`)."""
    hertz = default_frequencies(dt) if frequency_hz is None else np.asarray(frequency_hz, dtype=float)
    angles = 2.0 * np.pi * hertz * dt
    plant, controller, observer = (
        from_data(data, dt) for data in (block.problem.plant, block.problem.controller, block.observer)
    )
    delays = (block.delay_samples,) * len(block.axes)
    on = close_loop(plant, controller, observer, delays)
    off = close_loop(plant, controller, None, delays)
    Q, inverse = standard_form(observer, plant.D.shape[0], angles)
    G = response(plant, angles)

    def of(data: StateSpaceData) -> ComplexArray:
        return response(from_data(data, dt), angles)

    return Responses(
        frequency_hz=hertz,
        Q=Q,
        G_n_inverse=inverse,
        G=G,
        G_inverse=np.linalg.pinv(G, rcond=1e-13).astype(complex),
        d_to_estimate=response(on.part("d_hat", "d"), angles),
        d_to_rate_off=response(off.part("y", "d"), angles),
        d_to_rate_on=response(on.part("y", "d"), angles),
        n_to_estimate=response(on.part("d_hat", "n"), angles),
        error=response(on.part("error", "d"), angles),
        disturbance_weight=of(block.problem.disturbance_weight),
        noise_weight=of(block.problem.noise_weight),
    )


def standard_form(observer: Any, p: int, angles: Array) -> tuple[ComplexArray, ComplexArray]:
    """(Q, G_n^-1) of an observer with inputs [y_n (p); u_e]: -D_u and -D_u^-1 D_y at each angle.

    Where Q vanishes (a transmission zero, or z = inf) G_n^-1 does not exist; it is found in the least-squares sense.
    """
    D = response(observer, angles)
    Q = -D[:, :, p:]
    return Q, np.asarray(np.linalg.pinv(Q, rcond=1e-13) @ D[:, :, :p])

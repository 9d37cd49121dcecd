"""How far the responses of sampled uncertain plants spread, for the figure of a design's robustness."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import DobBlock
from dob_companion.lti.response import response, spectral_radius
from dob_companion.synthesis.certify.responses import default_frequencies
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.robust.analysis import SEED
from dob_companion.synthesis.robust.cells import factor_system, samples
from dob_companion.synthesis.spec.uncertainty import parse_uncertainty
from dob_companion.toml import Table

Array = NDArray[np.float64]

COUNT, POINTS = 40, 240


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Magnitudes of one response, (points, axes): of the model, and the least and the greatest of the samples."""

    model: Array
    low: Array
    high: Array


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Bands:
    """Of each axis to itself, over frequency in Hz: d -> y on and off, d -> d - z^-tau d_hat, and what bounds it.

    `allowed` is robust_gamma_bound / |W_d| (points, axes), None where no bound is proved. `stable` of `tried` sampled
    plants are stable with the observer; only these are in the bands. A multiplicative bound is not sampled here.
    """

    frequency_hz: Array
    rate_off: Spread
    rate_on: Spread
    error: Spread
    allowed: Array | None
    stable: int
    tried: int


def robust_bands(block: DobBlock, dt: float) -> Bands | None:
    """Bands of a block whose certificate records an uncertainty, else None."""
    extra = block.certificate.extra
    if "robust_uncertainty" not in extra:
        return None
    uncertainty = parse_uncertainty(Table("robust_uncertainty", extra["robust_uncertainty"]), block.axes)
    plant, controller, observer = (
        from_data(data, dt) for data in (block.problem.plant, block.problem.controller, block.observer)
    )
    delays = (block.delay_samples,) * len(block.axes)
    hertz = default_frequencies(dt, POINTS)
    angles = 2.0 * np.pi * hertz * dt
    drawn: list[list[Array]] = [[], [], []]
    seen = samples(uncertainty, COUNT, SEED)
    for sample in seen:
        true = plant * factor_system(uncertainty, sample, dt)
        on, off = (close_loop(true, controller, D, delays) for D in (observer, None))
        if spectral_radius(on.system.A) >= 1.0:
            continue
        parts = (off.part("y", "d"), on.part("y", "d"), on.part("error", "d"))
        for kept, part in zip(drawn, parts, strict=True):
            kept.append(np.abs(np.diagonal(response(part, angles), axis1=1, axis2=2)))
    rate_off, rate_on, error = (Spread(kept[0], np.min(kept, axis=0), np.max(kept, axis=0)) for kept in drawn)
    W_d = np.abs(np.diagonal(response(from_data(block.problem.disturbance_weight, dt), angles), axis1=1, axis2=2))
    bound = extra.get("robust_gamma_bound")
    allowed = bound / W_d if isinstance(bound, float) else None
    return Bands(
        frequency_hz=hertz,
        rate_off=rate_off,
        rate_on=rate_on,
        error=error,
        allowed=allowed,
        stable=len(drawn[0]),
        tried=len(seen),
    )

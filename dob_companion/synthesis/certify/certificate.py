"""What is proved about an observer, measured from its exact float64 matrices.

Nothing here comes from the solver. The closed loop is put together again from plant, controller, delay
and observer, and its norms are upper bounds (`norms/hinf.py`), checked against a frequency grid.
Definitions are those of docs/interfaces.md.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import Certificate
from dob_companion.artifact.flyable import GREATEST_COMMAND_LEAK
from dob_companion.errors import NotCertifiedError, NotConvergedError
from dob_companion.lti.response import gains, spectral_radius
from dob_companion.observer.missing import missing_in
from dob_companion.synthesis.certify.margins import (
    axis_disk_margins,
    bandwidth,
    complement,
    delay_margin,
    disk_margin,
    useful_delay,
)
from dob_companion.synthesis.norms.arcs import gain_bracket
from dob_companion.synthesis.norms.hinf import TOLERANCE, angle_grid, hinf_norm
from dob_companion.synthesis.plant.loop import Loop, close_loop
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.plant.problem import Problem

Array = NDArray[np.float64]

LEAK_WIDTH = 1e-12
"""Absolute width of the bracket of the command leak, which is rounding itself: no allowance for it is added."""


@dataclass(frozen=True, slots=True)
class Claim:
    """What the synthesis claims about gamma_star, and how far the observer may stay from it."""

    gamma_star: float
    method: str
    backoff: float


def certify(problem: Problem, observer: Any, claim: Claim) -> Certificate:
    """Measure an observer D(z), inputs [y_n; u_e].

    Raises NotCertifiedError when the loop or the observer is unstable, D has a direct path from u_e,
    the two ways to the norm disagree, a norm cannot be bounded, gamma exceeds backoff * gamma_star, or a command leaks
    into d_hat.
    """
    try:
        return _certified(problem, observer, claim)
    except NotConvergedError as trouble:
        raise NotCertifiedError(str(trouble)) from trouble


def _certified(problem: Problem, observer: Any, claim: Claim) -> Certificate:
    loop = close_loop(problem.plant, problem.controller, observer, problem.delays)
    radius, own = spectral_radius(loop.system.A), spectral_radius(observer.A)
    _require_sound(problem, observer, radius, own)
    gamma, peak = _gamma(problem, loop)
    allowed = claim.backoff * claim.gamma_star
    if not gamma <= allowed:
        raise NotCertifiedError(
            f"measured gamma {gamma:.7g}, expected at most {allowed:.7g} (gamma_backoff * gamma_star)"
        )
    hertz = 1.0 / (2.0 * np.pi * problem.dt)
    leak = gain_bracket(loop.part("d_hat", "w_r"), TOLERANCE, LEAK_WIDTH).high
    if not leak <= GREATEST_COMMAND_LEAK:
        raise NotCertifiedError(f"command leak {leak:.3g}, expected at most {GREATEST_COMMAND_LEAK:g}")
    return Certificate(
        gamma=gamma,
        gamma_star=claim.gamma_star,
        gamma_star_method=claim.method,
        gamma_backoff=claim.backoff,
        closed_loop_spectral_radius=radius,
        observer_spectral_radius=own,
        slowest_mode_s=-problem.dt / float(np.log(own)) if own > 0.0 else 0.0,
        command_leak=leak,
        disk_margin=disk_margin(loop),
        delay_margin_samples=delay_margin(problem, observer),
        estimation_bandwidth_hz=bandwidth(complement(loop.part("d_hat", "d"))) * hertz,
        extra={
            "order": observer.nstates,
            "gamma_peak_hz": peak * hertz,
            "slowest_mode_hz": _slowest_angle(observer) * hertz,
            "attenuation_bandwidth_hz": bandwidth(loop.part("error", "d")) * hertz,
            "noise_to_estimate_peak": hinf_norm(loop.part("d_hat", "n"))[0],
            "disk_margin_per_axis": axis_disk_margins(loop),
            "disk_margin_off": disk_margin(close_loop(problem.plant, problem.controller, None, problem.delays)),
            "useful_delay_samples": useful_delay(loop, problem.disturbance_weight),
            **_missing(problem, observer),
        },
    )


def _missing(problem: Problem, observer: Any) -> dict[str, int | None]:
    """Samples and moments in a row that may be missing in flight; None for a problem that no predictor follows, which
    does not fly."""
    try:
        bound = missing_in(problem, observer, max(problem.delays), problem.dt)
    except NotConvergedError:
        return {"missing_samples": None, "missing_moments": None}
    return {"missing_samples": bound.samples, "missing_moments": bound.moments}


def _require_sound(problem: Problem, observer: Any, radius: float, own: float) -> None:
    p, m = problem.plant.D.shape
    if own >= 1.0:
        raise NotCertifiedError(f"the observer is unstable: spectral radius {own:.9f}, expected below 1")
    if radius >= 1.0:
        raise NotCertifiedError(f"the loop with the observer is unstable: spectral radius {radius:.9f}")
    if np.any(observer.D[:, p : p + m] != 0.0):
        raise NotCertifiedError("the observer has a direct path from u_e, expected exactly zero")


def _gamma(problem: Problem, loop: Loop) -> tuple[float, float]:
    """|| (w_d, w_n) -> d - z^-tau d_hat ||, and the angle of its peak."""
    error = loop.part("error", "d", "n") * stack([problem.disturbance_weight, problem.noise_weight])
    gamma, peak = hinf_norm(error)
    on_grid = float(np.max(gains(error, np.append(angle_grid(error.A, 2000), peak))))
    if not gamma * 0.999 <= on_grid <= gamma * (1.0 + 1e-6):
        raise NotCertifiedError(f"norm {gamma:.9g} and its frequency grid {on_grid:.9g} disagree")
    return max(gamma, on_grid), peak


def _slowest_angle(observer: Any) -> float:
    poles = np.linalg.eigvals(observer.A)
    return float(abs(np.angle(poles[np.argmax(np.abs(poles))]))) if poles.size else 0.0

"""What is proved about an observer, measured from its exact float64 matrices.

Nothing here comes from the solver. The closed loop is put together again from plant, controller, delay
and observer, and its norms come from `norms.py` (a symplectic pencil), checked against a frequency grid.
Definitions are those of docs/interfaces.md.
"""

from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import Certificate
from dob_companion.errors import NotCertifiedError
from dob_companion.synthesis.loop import Loop, close_loop
from dob_companion.synthesis.models import stack
from dob_companion.synthesis.norms import angle_grid, gains, hinf_norm, response, spectral_radius
from dob_companion.synthesis.problem import Problem

Array = NDArray[np.float64]

MOST_DELAY_SAMPLES = 50
"""The search for the delay margin ends here; a margin of this size means "at least"."""

BAND_EDGE = 0.707
"""|1 - T| at the end of the estimation bandwidth."""


@dataclass(frozen=True, slots=True)
class Optimum:
    """What the synthesis claims about gamma_star, and how far the observer may stay from it."""

    gamma_star: float
    method: str
    backoff: float


def certify(problem: Problem, observer: Any, optimum: Optimum) -> Certificate:
    """Measure an observer D(z), inputs [y_n; u_e].

    Raises NotCertifiedError when the loop or the observer is unstable, D has a direct path from u_e,
    the two ways to the norm disagree, or gamma exceeds backoff * gamma_star.
    """
    loop = close_loop(problem.plant, problem.controller, observer, problem.delays)
    radius, own = spectral_radius(loop.system.A), spectral_radius(observer.A)
    _require_sound(problem, observer, radius, own)
    gamma, peak = _gamma(problem, loop)
    allowed = optimum.backoff * optimum.gamma_star
    if not gamma <= allowed:
        raise NotCertifiedError(
            f"measured gamma {gamma:.7g}, expected at most {allowed:.7g} (gamma_backoff * gamma_star)"
        )
    hertz = 1.0 / (2.0 * np.pi * problem.dt)
    return Certificate(
        gamma=gamma,
        gamma_star=optimum.gamma_star,
        gamma_star_method=optimum.method,
        gamma_backoff=optimum.backoff,
        closed_loop_spectral_radius=radius,
        observer_spectral_radius=own,
        slowest_mode_s=-problem.dt / float(np.log(own)) if own > 0.0 else 0.0,
        command_leak=hinf_norm(loop.part("d_hat", "w_r"))[0],
        disk_margin=disk_margin(loop),
        delay_margin_samples=delay_margin(problem, observer),
        estimation_bandwidth_hz=estimation_bandwidth(loop.part("d_hat", "d")) * hertz,
        extra={
            "order": observer.nstates,
            "gamma_peak_hz": peak * hertz,
            "slowest_mode_hz": _slowest_angle(observer) * hertz,
            "attenuation_bandwidth_hz": estimation_bandwidth(loop.part("error", "d"), given=True) * hertz,
            "noise_to_estimate_peak": hinf_norm(loop.part("d_hat", "n"))[0],
            "disk_margin_off": disk_margin(close_loop(problem.plant, problem.controller, None, problem.delays)),
        },
    )


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
    on_grid = float(np.max(gains(error, angle_grid(error.A, 4000))))
    if not gamma * 0.999 <= on_grid <= gamma * (1.0 + 1e-9):
        raise NotCertifiedError(f"norm {gamma:.9g} and its frequency grid {on_grid:.9g} disagree")
    return gamma, peak


def disk_margin(loop: Loop) -> float:
    """Largest disk of relative gain and phase error in every moment at once, skew 0 (Seiler et al., 2020).

    The loop is broken at u_e between the observer's tap and the plant, so that the observer does not know
    of the error: 1 / ||S - I/2||, S = d -> u_e + d. For several channels the structured norm's upper bound.
    """
    S = loop.part("u_e", "d")
    balanced = ct.ss(S.A, S.B, S.C, S.D + 0.5 * np.eye(loop.m), S.dt)
    if loop.m == 1:
        return 1.0 / hinf_norm(balanced)[0]
    angles = angle_grid(balanced.A, 1500)
    return 1.0 / float(np.max([structured_bound(M) for M in response(balanced, angles)]))


def structured_bound(M: NDArray[np.complex128]) -> float:
    """min over diagonal D > 0 of ||D M D^-1||: the structured singular value's bound for scalar complex blocks.

    Alternating balance of rows and columns (Osborne, J. ACM 7, 1960) of |M|, which bounds mu from above.
    """
    size = np.abs(M)
    scale = np.ones(len(M))
    for _ in range(30):
        off = (size * scale[:, None] / scale) * ~np.eye(len(M), dtype=bool)
        rows, columns = np.linalg.norm(off, axis=1), np.linalg.norm(off, axis=0)
        step = np.sqrt(np.where((rows > 0) & (columns > 0), columns / np.where(rows > 0, rows, 1.0), 1.0))
        scale = scale * step
        if np.max(np.abs(step - 1.0)) < 1e-6:
            break
    return float(min(np.linalg.norm(M * scale[:, None] / scale, 2), np.linalg.norm(M, 2)))


def delay_margin(problem: Problem, observer: Any) -> int:
    """Further whole samples of link delay, unknown to the observer, that leave the loop stable.

    A delay that the vehicle reports truly in u_e never destabilizes (d_hat then does not depend on
    the correction); one that the observer is not told about does, so that is the one counted.
    """
    m = len(problem.delays)
    for extra in range(1, MOST_DELAY_SAMPLES + 1):
        late = close_loop(problem.plant, problem.controller, observer, problem.delays, (extra,) * m)
        if spectral_radius(late.system.A) >= 1.0:
            return extra - 1
    return MOST_DELAY_SAMPLES


def estimation_bandwidth(T: Any, given: bool = False) -> float:
    """First angle (rad per sample) at which the gain of 1 - T exceeds 0.707; pi when it never does.

    `given` says that T is already the error.
    """
    error = T if given else ct.ss(T.A, T.B, -T.C, np.eye(len(T.D)) - T.D, T.dt)
    angles = angle_grid(error.A, 4000)
    beyond = np.flatnonzero(gains(error, angles) > BAND_EDGE)
    if beyond.size == 0:
        return float(np.pi)
    if beyond[0] == 0:
        return 0.0
    low, high = angles[beyond[0] - 1], angles[beyond[0]]
    for _ in range(40):
        middle = (low + high) / 2.0
        low, high = (low, middle) if gains(error, np.array([middle]))[0] > BAND_EDGE else (middle, high)
    return float(high)


def _slowest_angle(observer: Any) -> float:
    poles = np.linalg.eigvals(observer.A)
    return float(abs(np.angle(poles[np.argmax(np.abs(poles))]))) if poles.size else 0.0

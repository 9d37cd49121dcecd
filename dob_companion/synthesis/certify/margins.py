"""How far the loop with the observer is from instability: disk margins, delay margins, bandwidth.

All angles are in rad per sample.
"""

from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.lti import margins as lti
from dob_companion.lti.margins import MOST_DELAY_SAMPLES
from dob_companion.lti.response import gains, response
from dob_companion.synthesis.norms.hinf import angle_grid, hinf_norm
from dob_companion.synthesis.norms.structured import structured_bounds
from dob_companion.synthesis.plant.loop import Loop, close_loop
from dob_companion.synthesis.plant.problem import Problem

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

COUPLED_TOLERANCE = 1e-5
"""Relative width of the bracket of a disk margin of several moments."""

VANISHING = 1e-6
"""Share of the terms that an entry of a response is summed from below which it is not scaled any smaller."""

BAND_EDGE = 0.707
"""|1 - T| at the end of a bandwidth."""


def disk_margin(loop: Loop) -> float:
    """Largest disk of gain and phase error in all moments at once, skew 0 (Seiler et al., IEEE CSM 40(5), 2020).

    The loop is broken at u_e between the observer's tap and the plant, so that the observer does not know
    of the error: 1 / mu(S - I/2), S = d -> u_e + d. For several moments mu's upper bound over diagonal
    scalings (exact up to three) at each frequency, as in python-control, proved between frequencies as well.
    """
    S = _balanced_sensitivity(loop)
    if loop.m == 1:
        return 1.0 / hinf_norm(S)[0]
    return 1.0 / hinf_norm(S, COUPLED_TOLERANCE, scaling=_scales)[0]


def _scales(M: ComplexArray, sizes: Array) -> Array:
    return structured_bounds(M, VANISHING * sizes)[1]


def axis_disk_margins(loop: Loop) -> list[float]:
    """The disk margin of each moment alone, the others exact."""
    S = _balanced_sensitivity(loop)
    return [1.0 / hinf_norm(S[[i], [i]])[0] for i in range(loop.m)]


def delay_margin(problem: Problem, observer: Any) -> int:
    """Further whole samples of link delay, unknown to the observer, that leave the loop stable.

    A delay that the vehicle reports truly in u_e never destabilizes (d_hat then does not depend on
    the correction); one that the observer is not told about does, so that is the one counted.
    """
    m = len(problem.delays)

    def late(extra: int) -> Array:
        loop = close_loop(problem.plant, problem.controller, observer, problem.delays, (extra,) * m)
        return np.asarray(loop.system.A)

    return lti.delay_margin(late)


def useful_delay(loop: Loop, disturbance_weight: Any) -> int:
    """Further samples of link delay, reported truly in u_e, for which the observer still helps.

    It helps while the RMS of d - z^-(tau+k) d_hat stays below that of d, for d of spectrum W_d.
    """
    error = loop.part("error", "d")
    angles = np.unique(np.concatenate([angle_grid(disturbance_weight.A, 3000), angle_grid(error.A, 1000)]))
    shape, late = response(disturbance_weight, angles), np.eye(loop.m) - response(error, angles)
    off = _power(shape, angles)
    for extra in range(1, MOST_DELAY_SAMPLES + 1):
        turned = late * np.exp(-1j * extra * angles)[:, None, None]
        if _power((np.eye(loop.m) - turned) @ shape, angles) >= off:
            return extra - 1
    return MOST_DELAY_SAMPLES


def bandwidth(error: Any) -> float:
    """First angle at which the gain of an error transfer function exceeds 0.707; pi when it never does."""
    angles = angle_grid(error.A, 2000)
    beyond = np.flatnonzero(gains(error, angles) > BAND_EDGE)
    if beyond.size == 0:
        return float(np.pi)
    if beyond[0] == 0:
        return 0.0
    low, high = angles[beyond[0] - 1], angles[beyond[0]]
    for _ in range(5):
        fine = np.linspace(low, high, 33)
        first = int(np.argmax(gains(error, fine) > BAND_EDGE))
        low, high = fine[first - 1], fine[first]
    return float(high)


def complement(T: Any) -> Any:
    """I - T."""
    return ct.ss(T.A, T.B, -T.C, np.eye(len(T.D)) - T.D, T.dt)


def _balanced_sensitivity(loop: Loop) -> Any:
    S = loop.part("u_e", "d")  # S - I: the d that enters directly is not part of u_e
    return ct.ss(S.A, S.B, S.C, S.D + 0.5 * np.eye(loop.m), S.dt)


def _power(G: ComplexArray, angles: Array) -> float:
    return float(np.trapezoid(np.sum(np.abs(G) ** 2, axis=(1, 2)), angles))

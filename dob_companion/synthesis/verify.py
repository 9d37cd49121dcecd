"""A design verified again from its file alone: every norm recomputed, every recorded number compared."""

from dataclasses import dataclass

import numpy as np

from dob_companion.artifact import Certificate, DobBlock, DobDesign
from dob_companion.errors import RefusedError
from dob_companion.synthesis.certificate import Claim, certify
from dob_companion.synthesis.models import from_data
from dob_companion.synthesis.optimum import find_optimum
from dob_companion.synthesis.problem import Problem
from dob_companion.synthesis.solvability import require_solvable

RELATIVE = 1e-5
"""Agreement expected of recorded and recomputed numbers; they differ only by the machine's rounding."""

ABSOLUTE = 1e-9

MEASURED = (
    "gamma",
    "closed_loop_spectral_radius",
    "observer_spectral_radius",
    "slowest_mode_s",
    "command_leak",
    "disk_margin",
    "delay_margin_samples",
    "estimation_bandwidth_hz",
)


@dataclass(frozen=True, slots=True)
class Finding:
    """One number of a certificate: as recorded, and as measured again."""

    block: str
    name: str
    recorded: float
    measured: float
    agrees: bool


def problem_of(block: DobBlock, dt: float) -> Problem:
    """The stored problem of a block as python-control systems."""
    stored = block.problem
    return Problem(
        plant=from_data(stored.plant, dt),
        controller=from_data(stored.controller, dt),
        disturbance_weight=from_data(stored.disturbance_weight, dt),
        noise_weight=from_data(stored.noise_weight, dt),
        delays=(block.delay_samples,) * len(block.axes),
    )


def verify(design: DobDesign) -> tuple[Finding, ...]:
    """Measure every block again and compare.

    Raises UnsolvableError or NotCertifiedError, naming the block, when the stored problem has no solution or
    the stored observer fails its proof outright.
    """
    return tuple(finding for block in design.blocks for finding in _verify_block(block, design.dt))


def _verify_block(block: DobBlock, dt: float) -> list[Finding]:
    problem, recorded = problem_of(block, dt), block.certificate
    try:
        require_solvable(problem, block.axes)
        gamma_star = find_optimum(problem).gamma_star
        claim = Claim(recorded.gamma_star, recorded.gamma_star_method, recorded.gamma_backoff)
        measured = certify(problem, from_data(block.observer, dt), claim)
    except RefusedError as refusal:
        raise type(refusal)(f"block {block.name!r}: {refusal}") from refusal
    # A lower bound may stand lower than the one found now (that is safe), but not higher.
    bound = Finding(
        block.name, "gamma_star", recorded.gamma_star, gamma_star, recorded.gamma_star <= gamma_star * (1.0 + RELATIVE)
    )
    return [bound, *(_compare(block.name, name, recorded, measured) for name in MEASURED)]


def _compare(block: str, name: str, recorded: Certificate, measured: Certificate) -> Finding:
    was, now = float(getattr(recorded, name)), float(getattr(measured, name))
    return Finding(block, name, was, now, bool(np.isclose(was, now, rtol=RELATIVE, atol=ABSOLUTE)))

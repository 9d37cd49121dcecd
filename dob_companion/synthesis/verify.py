"""A design verified again from its file alone: every norm recomputed, every recorded number compared."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dob_companion.artifact import Certificate, DobBlock, DobDesign
from dob_companion.errors import DobError, placed
from dob_companion.synthesis.certify.certificate import Claim, certify
from dob_companion.synthesis.numeric import numbers_judged
from dob_companion.synthesis.optimal.reached import GAINS, attenuation_findings, recorded_weather
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.plant.solvability import require_solvable
from dob_companion.synthesis.plant.stored import problem_of
from dob_companion.synthesis.robust.analysis import FACTOR_STEP, TIGHT
from dob_companion.synthesis.robust.search import measured_again
from dob_companion.synthesis.solve.optimum import find_optimum

RELATIVE = 1e-5
"""Agreement expected of recorded and recomputed numbers; they differ only by the machine's rounding."""

ABSOLUTE = 1e-9

SEARCHED = {
    "robust_safe_factor": 2.0 * FACTOR_STEP,
    "robust_unsafe_factor": 2.0 * FACTOR_STEP,
    "robust_gamma_nominal": RELATIVE,
    "robust_gamma_sampled": RELATIVE,
    "robust_gamma_bound": TIGHT,
}
"""Findings over an uncertainty, and how accurately each is searched for."""

ATTENUATIONS = {
    "attenuation": RELATIVE,
    **{f"attenuation_at_{gain:g}": RELATIVE for gain in GAINS},
    "attenuation_limit": 1e-3,
    "misreading": RELATIVE,
}
"""Findings of a stated weather, and how accurately each is searched for."""

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


def verify(design: DobDesign) -> tuple[Finding, ...]:
    """Measure every block again and compare.

    Raises UnsolvableError or NotCertifiedError, naming the block, when the stored problem has no solution or
    the stored observer fails its proof outright, and SpecError when its systems do not fit together.
    """
    return tuple(finding for block in design.blocks for finding in _verify_block(block, design.dt))


def _verify_block(block: DobBlock, dt: float) -> list[Finding]:
    try:
        with numbers_judged():
            return _findings(block, dt)
    except DobError as problem:
        raise placed(problem, f"block {block.name!r}") from problem


def _findings(block: DobBlock, dt: float) -> list[Finding]:
    problem, recorded = problem_of(block, dt), block.certificate
    require_solvable(problem, block.axes)
    gamma_star = find_optimum(problem).gamma_star
    claim = Claim(recorded.gamma_star, recorded.gamma_star_method, recorded.gamma_backoff)
    measured = certify(problem, from_data(block.observer, dt), claim)
    # A lower bound may stand lower than the one found now (that is safe), but not higher.
    bound = Finding(
        block.name, "gamma_star", recorded.gamma_star, gamma_star, recorded.gamma_star <= gamma_star * (1.0 + RELATIVE)
    )
    found = [bound, *(_compare(block.name, name, recorded, measured) for name in MEASURED)]
    if "robust_uncertainty" in recorded.extra:
        found += _verify_robustness(block, problem, dt)
    return found + _verify_attenuation(block, problem, dt, measured.disk_margin)


def _verify_attenuation(block: DobBlock, problem: Problem, dt: float, disk_margin: float) -> list[Finding]:
    """In the weather that the file states; a file that tells an attenuation must say in which."""
    extra = block.certificate.extra
    auto = recorded_weather(extra, dt, "certificate")
    again = attenuation_findings(problem, from_data(block.observer, dt), auto, disk_margin) if auto else {}
    was, now = _attenuations(extra), _attenuations(again)
    found = []
    for name, share in ATTENUATIONS.items():
        if name in was or name in now:
            recorded, measured = was.get(name, np.nan), now.get(name, np.nan)
            same = bool(np.isclose(recorded, measured, rtol=share))
            found.append(Finding(block.name, name, recorded, measured, same))
    return found


def _attenuations(extra: Mapping[str, object]) -> dict[str, float]:
    """The numbers among them; a loop that is unstable at a gain has none there."""
    at = extra.get("attenuation_at_gains")
    told = {f"attenuation_at_{gain}": value for gain, value in (at if isinstance(at, dict) else {}).items()}
    told |= {name: extra[name] for name in ATTENUATIONS if name in extra}
    return {name: float(value) for name, value in told.items() if isinstance(value, int | float)}


def _verify_robustness(block: DobBlock, problem: Problem, dt: float) -> list[Finding]:
    """Every robust number there is must stand in the file and agree to the accuracy of its search."""
    extra = block.certificate.extra
    measured = measured_again(problem, from_data(block.observer, dt), block.axes, extra).record()
    found = []
    for name, share in SEARCHED.items():
        if name in measured or name in extra:
            was, now = (float(values.get(name, np.nan)) for values in (extra, measured))  # type: ignore[arg-type]
            found.append(Finding(block.name, name, was, now, bool(np.isclose(was, now, rtol=share))))
    return found


def _compare(block: str, name: str, recorded: Certificate, measured: Certificate) -> Finding:
    was, now = float(getattr(recorded, name)), float(getattr(measured, name))
    return Finding(block, name, was, now, bool(np.isclose(was, now, rtol=RELATIVE, atol=ABSOLUTE)))

"""From problem to certified observer, and from spec to a whole design."""

from dataclasses import dataclass, replace
from typing import Any

import control as ct

import dob_companion
from dob_companion.artifact import Certificate, DobBlock, DobDesign
from dob_companion.artifact import Problem as StoredProblem
from dob_companion.errors import NotCertifiedError, RefusedError, SpecError
from dob_companion.synthesis.certificate import Claim, certify
from dob_companion.synthesis.model_file import Reader
from dob_companion.synthesis.models import to_data, to_state_space, weight_to_state_space
from dob_companion.synthesis.optimum import Optimum, candidates, find_optimum
from dob_companion.synthesis.problem import Problem
from dob_companion.synthesis.reduce import HIDDEN, minimal
from dob_companion.synthesis.reduction import certified_of_order
from dob_companion.synthesis.robust_design import robust_synthesis
from dob_companion.synthesis.solvability import require_solvable
from dob_companion.synthesis.spec import BlockSpec, Spec, parse_spec
from dob_companion.synthesis.uncertainty import Uncertainty


@dataclass(frozen=True, slots=True, eq=False)
class Synthesis:
    """A certified observer: D(z) with inputs [y_n; u_e] and output d_hat, and what was proved about it."""

    problem: Problem
    observer: Any
    certificate: Certificate


def synthesize(
    plant: Any,
    controller: Any,
    disturbance_weight: Any,
    noise_weight: Any,
    *,
    delay_samples: int | tuple[int, ...] = 1,
    gamma_backoff: float = 1.01,
    axes: tuple[str, ...] | None = None,
    uncertainty: Uncertainty | None = None,
    largest_order: int | None = None,
) -> Synthesis:
    """The H-infinity optimal disturbance observer of one block, within gamma_backoff of the optimum.

    All systems are discrete python-control StateSpace or TransferFunction of one dt: plant (p, m) from moment
    (u_e + d) to rate, controller (m, p) of u = C (r - y_n), weights with m and p outputs. `delay_samples` from
    d_hat to the acting moment, for all inputs or one each. `axes` names the channels in messages.

    With an `uncertainty` of the plant the noise weight is raised until the worst plant is served best
    (`robust_design`), and the certificate gains robust_* findings; the problem returned is the one solved for.

    With a `largest_order` an observer of more states is reduced to it and certified anew (`reduction`).

    Raises UnsolvableError when no observer exists (naming channel, mode and physics) and NotCertifiedError
    when one was computed but its proof failed.
    """
    plant, controller, disturbance_weight, noise_weight = map(
        ct.ss, (plant, controller, disturbance_weight, noise_weight)
    )
    m = plant.D.shape[1]
    delays = (delay_samples,) * m if isinstance(delay_samples, int) else tuple(delay_samples)
    problem = Problem(plant, controller, disturbance_weight, noise_weight, delays)
    require_solvable(problem, axes)
    problem = Problem(minimal(plant), minimal(controller), minimal(disturbance_weight), minimal(noise_weight), delays)
    if uncertainty is None:
        return Synthesis(problem, *_certified(problem, gamma_backoff, largest_order))
    found = robust_synthesis(problem, uncertainty, axes, lambda posed: _certified(posed, gamma_backoff, largest_order))
    return Synthesis(found.problem, found.observer, found.certificate)


def design_block(spec: BlockSpec, dt: float, gamma_backoff: float) -> DobBlock:
    """One block of a spec, designed and certified from the very matrices that go into the file.

    Raises SpecError when it has no weights, and as `synthesize` does.
    """
    size = len(spec.axes)
    if spec.disturbance is None or spec.noise is None:
        raise SpecError(f"{spec.where}: key 'weights' is missing; give weights, or design with --auto")
    try:
        result = synthesize(
            to_state_space(spec.plant, dt, (size, size)),
            to_state_space(spec.controller, dt, (size, size)),
            weight_to_state_space(spec.disturbance, dt, size),
            weight_to_state_space(spec.noise, dt, size),
            delay_samples=spec.delay_samples,
            gamma_backoff=gamma_backoff,
            axes=spec.axes,
            uncertainty=spec.uncertainty,
            largest_order=spec.largest_order,
        )
    except RefusedError as refusal:
        raise type(refusal)(f"block {spec.name!r}: {refusal}") from refusal
    problem = result.problem
    return DobBlock(
        name=spec.name,
        axes=spec.axes,
        delay_samples=spec.delay_samples,
        observer=to_data(result.observer),
        problem=StoredProblem(
            plant=to_data(problem.plant),
            controller=to_data(problem.controller),
            disturbance_weight=to_data(problem.disturbance_weight),
            noise_weight=to_data(problem.noise_weight),
        ),
        certificate=result.certificate,
    )


def design(spec: Spec, created: str = "") -> DobDesign:
    """Design every block of a spec; `created` is the RFC 3339 time to write into it (no clock is read here).

    Raises SpecError, UnsolvableError or NotCertifiedError.
    """
    blocks = tuple(design_block(block, spec.dt, spec.gamma_backoff) for block in spec.blocks)
    return DobDesign(
        dt=spec.dt,
        delay_samples=spec.delay_samples,
        blocks=blocks,
        created=created,
        generator=f"dob-companion {dob_companion.__version__}",
    )


def design_from_toml(
    text: str,
    source: str = "spec.toml",
    created: str = "",
    read: Reader | None = None,
    *,
    largest_order: int | None = None,
) -> DobDesign:
    """From a spec's text to a certified design; see `parse_spec` and `design` for `read` and the errors raised.

    `largest_order` overrides the spec's, for every block.
    """
    spec = parse_spec(text, source, read)
    if largest_order is not None:
        spec = replace(spec, blocks=tuple(replace(block, largest_order=largest_order) for block in spec.blocks))
    try:
        return design(spec, created)
    except RefusedError as refusal:
        raise type(refusal)(f"{source}: {refusal}") from refusal


def _certified(problem: Problem, backoff: float, largest_order: int | None) -> tuple[Any, Certificate]:
    """The first candidate that passes its proof, without hidden modes and reduced to `largest_order` if need be."""
    optimum = find_optimum(problem)
    claim = Claim(optimum.gamma_star, optimum.method, backoff)
    observer, proof = _full_order(problem, optimum, claim)
    if largest_order is None or observer.nstates <= largest_order:
        return observer, proof
    nearer = [minimal(candidate) for candidate in candidates(optimum, backoff)]  # they leave room for the reduction
    return certified_of_order(problem, [observer, *nearer], claim, largest_order)


def _full_order(problem: Problem, optimum: Optimum, claim: Claim) -> tuple[Any, Certificate]:
    backoff = claim.backoff
    failures = [NotCertifiedError(f"no observer found within {backoff:g} of gamma_star {optimum.gamma_star:.7g}")]
    for candidate in candidates(optimum, backoff):
        for tolerance in HIDDEN:
            try:
                observer = minimal(candidate, tolerance)
                return observer, certify(problem, observer, claim)
            except NotCertifiedError as failure:
                failures.append(failure)
    raise failures[min(1, len(failures) - 1)]  # the first real one: it came closest

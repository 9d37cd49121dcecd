"""From problem to certified observer, and from spec to a whole design."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import dob_companion
from dob_companion.artifact import (
    AXES,
    LARGEST_DISTURBANCE,
    Certificate,
    DobBlock,
    DobDesign,
    certificate_table,
    check_flyable,
    dumps,
)
from dob_companion.artifact import Problem as StoredProblem
from dob_companion.errors import DobError, NotCertifiedError, NotConvergedError, RefusedError, SpecError, placed
from dob_companion.synthesis.certify.certificate import Claim, certify
from dob_companion.synthesis.certify.reduction import certified_of_order
from dob_companion.synthesis.numeric import numbers_judged
from dob_companion.synthesis.optimal.exact import exact_optimum
from dob_companion.synthesis.optimal.reached import WEATHER, attenuation_findings
from dob_companion.synthesis.plant.minimal import HIDDEN, minimal
from dob_companion.synthesis.plant.models import from_data, to_data, to_state_space, weight_to_state_space
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.plant.solvability import require_solvable
from dob_companion.synthesis.plant.stored import problem_of
from dob_companion.synthesis.robust.programme import programmed
from dob_companion.synthesis.robust.search import robust_synthesis
from dob_companion.synthesis.solve.optimum import Optimum, candidates, find_optimum
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.inputs import discrete_system, link_delays, require_options
from dob_companion.synthesis.spec.model_file import Reader
from dob_companion.synthesis.spec.parse import BlockSpec, Spec, parse_spec
from dob_companion.synthesis.spec.uncertainty import Uncertainty

Solve = Callable[[Problem], tuple[Any, Certificate]]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Synthesis:
    """A certified observer: D(z) with inputs [y_n; u_e] and output d_hat, and what was proved about it.

    `axes` are the names that `synthesize` was given. Printed, it is the table that `dob-companion design` prints.
    """

    problem: Problem
    observer: Any
    certificate: Certificate
    axes: tuple[str, ...] | None = None

    def __repr__(self) -> str:
        late = ", ".join(map(str, sorted(set(self.problem.delays))))
        name = "-".join(self.axes) if self.axes else "observer"
        head = f"{1 / self.problem.dt:g} Hz, delay {late}"
        return certificate_table(head, [(name, self.observer.nstates, self.certificate)])

    def block(self) -> DobBlock:
        """The block of a design.json. Raises SpecError unless the axes are hover axes and share one link delay."""
        axes, delays = self.axes or (), set(self.problem.delays)
        if not axes or not set(axes) <= set(AXES) or len(set(axes)) < len(axes):
            raise SpecError(
                f"axes: {axes or None}, expected different ones of {', '.join(AXES)}: synthesize(…, axes=…)"
            )
        if len(delays) > 1:
            raise SpecError(f"delay_samples: {self.problem.delays}, expected one for all axes of a design.json's block")
        problem = self.problem
        return DobBlock(
            name="-".join(axes),
            axes=axes,
            delay_samples=delays.pop(),
            observer=to_data(self.observer),
            problem=StoredProblem(
                plant=to_data(problem.plant),
                controller=to_data(problem.controller),
                disturbance_weight=to_data(problem.disturbance_weight),
                noise_weight=to_data(problem.noise_weight),
            ),
            certificate=self.certificate,
        )


def design_json(*results: Synthesis, created: str = "") -> str:
    """The text of a design.json that flies: one block for each result of `synthesize`, their `axes` all different.

    Raises SpecError when results do not fit together, DesignFileError when a certificate is not fit to fly.
    """
    rates = {result.problem.dt for result in results}
    blocks = tuple(result.block() for result in results)
    axes = [axis for block in blocks for axis in block.axes]
    if len(rates) != 1 or len(set(axes)) < len(axes):
        raise SpecError(f"design: axes {axes} at dt {sorted(rates)}, expected each axis once, and one dt")
    dt = rates.pop()
    made = DobDesign(
        dt=dt,
        delay_samples=max(block.delay_samples for block in blocks),
        blocks=blocks,
        created=created,
        generator=f"dob-companion {dob_companion.__version__}",
    )
    check_flyable(made, 1.0 / dt, "design")
    return dumps(made)[0]


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
    auto: AutoSpec | None = None,
) -> Synthesis:
    """The H-infinity optimal disturbance observer of one block, within gamma_backoff of the optimum.

    All systems are discrete python-control StateSpace or TransferFunction of one dt: plant (p, m) from moment
    (u_e + d) to rate, controller (m, p) of u = C (r - y_n), weights with m and p outputs. `delay_samples` from
    d_hat to the acting moment, for all inputs or one each. `axes` names the channels in messages.

    With an `uncertainty` of the plant the noise weight is raised until the worst plant is served best
    (`robust/search.py`); for one axis and with `auto`, what a pilot wants, the best observer for that is found among
    all that bear the uncertainty (`robust/programme.py`). The certificate gains robust_* findings; the problem returned
    is the one solved for.

    With a `largest_order` an observer of more states is reduced to it and certified anew (`reduction`).

    Raises UnsolvableError when no observer exists (naming channel, mode and physics) and NotCertifiedError
    when one was computed but its proof failed.
    """
    named = (
        (plant, "plant"),
        (controller, "controller"),
        (disturbance_weight, "disturbance weight"),
        (noise_weight, "noise weight"),
    )
    G, C, W_d, W_n = (discrete_system(system, name) for system, name in named)
    moments = G.D.shape[1]
    axes = require_options(moments, gamma_backoff, axes, uncertainty, largest_order)
    problem = Problem(G, C, W_d, W_n, link_delays(delay_samples, moments))
    with numbers_judged():
        require_solvable(problem, axes)
        solve = lambda posed: _certified(posed, gamma_backoff, largest_order, W_d)  # noqa: E731
        return _synthesized(problem, axes, uncertainty, solve, auto, largest_order)


def _synthesized(
    problem: Problem,
    axes: tuple[str, ...] | None,
    uncertainty: Uncertainty | None,
    solve: Solve,
    auto: AutoSpec | None,
    largest_order: int | None,
) -> Synthesis:
    problem = Problem(
        minimal(problem.plant),
        minimal(problem.controller),
        minimal(problem.disturbance_weight),
        minimal(problem.noise_weight),
        problem.delays,
    )
    if uncertainty is None:
        return Synthesis(problem, *solve(problem), axes)
    alone = len(problem.delays) == 1 and not np.any(problem.plant.D)
    made = None
    if auto is not None and alone and uncertainty.synthesis == "robust":
        made = programmed(problem, uncertainty, auto, largest_order)
    found = robust_synthesis(problem, uncertainty, axes, solve, made)
    return Synthesis(found.problem, found.observer, found.certificate, axes)


def design_block(spec: BlockSpec, dt: float, auto: AutoSpec | None = None) -> DobBlock:
    """One block of a spec, designed and certified from the very matrices that go into the file.

    `auto` is what is wanted of a robust one. Raises SpecError when it has no weights, and as `synthesize` does.
    """
    size = len(spec.axes)
    if spec.disturbance is None or spec.noise is None:
        raise SpecError(f"{spec.where}: key 'weights' is missing; give weights, or design with --auto")
    try:
        with numbers_judged():
            systems = (
                to_state_space(spec.plant, dt, (size, size)),
                to_state_space(spec.controller, dt, (size, size)),
                weight_to_state_space(spec.disturbance, dt, size),
                weight_to_state_space(spec.noise, dt, size),
            )
        result = synthesize(
            *systems,
            delay_samples=spec.delay_samples,
            gamma_backoff=spec.gamma_backoff,
            axes=spec.axes,
            uncertainty=spec.uncertainty,
            largest_order=spec.largest_order,
            auto=auto,
        )
    except DobError as problem:
        raise placed(problem, spec.where) from problem
    block = replace(result.block(), name=spec.name)
    if spec.largest_disturbance is None:
        return block
    stated = {LARGEST_DISTURBANCE: spec.largest_disturbance}
    return replace(block, certificate=replace(block.certificate, extra={**block.certificate.extra, **stated}))


def design(spec: Spec, created: str = "") -> DobDesign:
    """Design every block of a spec; `created` is the RFC 3339 time to write into it (no clock is read here).

    Raises SpecError, UnsolvableError or NotCertifiedError.
    """
    blocks = (design_block(block, spec.dt, block.auto) for block in spec.blocks)
    return assembled(spec, tuple(blocks), created)


def assembled(spec: Spec, blocks: tuple[DobBlock, ...], created: str = "") -> DobDesign:
    """The design of a spec whose blocks are done."""
    return DobDesign(
        dt=spec.dt,
        delay_samples=spec.delay_samples,
        blocks=tuple(
            with_attenuation(block, spec.dt, asked.auto) for block, asked in zip(blocks, spec.blocks, strict=True)
        ),
        created=created,
        generator=f"dob-companion {dob_companion.__version__}",
    )


def with_attenuation(block: DobBlock, dt: float, auto: AutoSpec | None) -> DobBlock:
    """The block with what its certificate says of the attenuation, where the weather is stated and that is not done."""
    if auto is None or WEATHER in block.certificate.extra:
        return block
    proof = block.certificate
    found = attenuation_findings(problem_of(block, dt), from_data(block.observer, dt), auto, proof.disk_margin)
    return replace(block, certificate=replace(proof, extra={**proof.extra, **found}))


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
    return design(spec, created)


def _certified(problem: Problem, backoff: float, largest_order: int | None, stated: Any) -> tuple[Any, Certificate]:
    """The first candidate that passes its proof, without hidden modes and reduced to `largest_order` if need be.

    `stated` is the disturbance weight with all its modes: nearly hidden ones matter to its optimum in closed form.
    """
    optimum = find_optimum(problem)
    claim = Claim(optimum.gamma_star, optimum.method, backoff)
    observer, proof = _full_order(problem, optimum, claim)
    if largest_order is None or observer.nstates <= largest_order:
        return observer, proof
    nearer = [minimal(candidate) for candidate in candidates(optimum, backoff)]  # they leave room for the reduction
    whole = replace(problem, disturbance_weight=stated)
    exact = lambda near: exact_optimum(whole, near, optimum.gamma_star)  # noqa: E731
    return certified_of_order(problem, [observer, *nearer], claim, largest_order, exact)


def _full_order(problem: Problem, optimum: Optimum, claim: Claim) -> tuple[Any, Certificate]:
    backoff = claim.backoff
    none = f"no observer found within {backoff:g} of gamma_star {optimum.gamma_star:.7g}"
    failures: list[RefusedError] = [NotCertifiedError(none)]
    for candidate in candidates(optimum, backoff):
        for tolerance in HIDDEN:
            try:
                observer = minimal(candidate, tolerance)
                return observer, certify(problem, observer, claim)
            except (NotCertifiedError, NotConvergedError) as failure:
                failures.append(failure)
    raise failures[min(1, len(failures) - 1)]  # the first real one: it came closest

"""Uncertainty enters the synthesis where only weights are known: their scale is iterated, as D and K in turn.

Where a spec says what disturbances there are and what must be kept, `programme.py` does better.

With command invariance the observer of a wrong model sees the extra disturbance q = (phi - 1) v at the plant's
input as if it were noise of the shape of the loop. The K step is the estimator of the same problem with
its noise weight raised by a constant s (a constant D-scale between the two inputs); the D step picks s by what is
proved about the result: robust stability first, then the bound of the worst gain *with the weights that were
asked for*. This is not full D-K iteration: there D depends on frequency and the K step weighs v, which is the estimate
seen through the baseline's sensitivity, so it is no longer an estimation problem and would give up
command invariance by construction.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import control as ct
import numpy as np

from dob_companion.artifact import Certificate
from dob_companion.errors import RefusedError
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.robust.analysis import Robustness, analyse, worth
from dob_companion.synthesis.robust.programme import Made
from dob_companion.synthesis.spec.uncertainty import Uncertainty, parse_uncertainty
from dob_companion.toml import Table

SCALES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
"""Scales tried first, upwards, until the worst case has grown twice in a row."""

REFINEMENTS = 2
"""How often the neighbourhood of the best scale is then halved."""

Solve = Callable[[Problem], tuple[Any, Certificate]]


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """One observer of the search: solved for `problem`, whose noise weight is `scale` times the asked one.

    `worth` is what is proved about it with the asked weights; less is better.
    """

    scale: float
    problem: Problem
    observer: Any
    certificate: Certificate
    worth: tuple[bool, float]


def robust_synthesis(
    asked: Problem,
    uncertainty: Uncertainty,
    axes: tuple[str, ...] | None,
    solve: Solve,
    made: Made | None = None,
) -> Made:
    """The best observer found; with `synthesis = "nominal"` the one of the asked weights, analysed.

    `made` is an observer found already (`programme.py`); else the noise weight is scaled. The certificate carries the
    findings as robust_* keys; `robust_noise_scale` is s. Raises what `solve` raises when the asked problem fails.
    """
    scale = 1.0
    if made is None:
        best = _candidate(asked, uncertainty, solve, scale)
        if uncertainty.synthesis == "robust":
            best = _search(asked, uncertainty, solve, best)
        scale, made, weighted = best.scale, Made(best.problem, best.observer, best.certificate), asked
    else:
        weighted = made.problem
    names = axes or tuple(f"input {i + 1}" for i in range(len(uncertainty.channels)))
    stated = {"robust_uncertainty": uncertainty.to_object(names), "robust_noise_scale": scale}
    found = stated | analyse(weighted, made.observer, uncertainty).record()
    return replace(made, certificate=replace(made.certificate, extra={**made.certificate.extra, **found}))


def noise_scaled(problem: Problem, scale: float) -> Problem:
    """The problem with its noise weight times `scale`."""
    W = problem.noise_weight
    return replace(problem, noise_weight=ct.ss(W.A, W.B, scale * W.C, scale * W.D, W.dt))


def measured_again(solved: Problem, observer: Any, axes: tuple[str, ...], extra: Mapping[str, Any]) -> Robustness:
    """The analysis that a certificate with robust_* keys records, from the problem in its file (the one solved for)."""
    uncertainty = parse_uncertainty(Table("robust_uncertainty", extra["robust_uncertainty"]), axes)
    return analyse(noise_scaled(solved, 1.0 / float(extra["robust_noise_scale"])), observer, uncertainty)


def _search(asked: Problem, uncertainty: Uncertainty, solve: Solve, best: Candidate) -> Candidate:
    worse = 0
    for scale in SCALES[1:]:
        tried = _attempt(asked, uncertainty, solve, scale)
        worse = 0 if tried is not None and tried.worth < best.worth else worse + 1
        best = tried if tried is not None and tried.worth < best.worth else best
        if worse == 2 and not best.worth[0]:
            break
    step = np.sqrt(2.0)
    for _ in range(REFINEMENTS):
        near = (_attempt(asked, uncertainty, solve, best.scale * turn) for turn in (1.0 / step, step))
        best = min([best, *(one for one in near if one is not None)], key=lambda one: one.worth)
        step = np.sqrt(step)
    return best


def _attempt(asked: Problem, uncertainty: Uncertainty, solve: Solve, scale: float) -> Candidate | None:
    try:
        return _candidate(asked, uncertainty, solve, scale)
    except RefusedError:  # another scale may do
        return None


def _candidate(asked: Problem, uncertainty: Uncertainty, solve: Solve, scale: float) -> Candidate:
    problem = asked if scale == 1.0 else noise_scaled(asked, scale)
    observer, certificate = solve(problem)
    return Candidate(scale, problem, observer, certificate, worth(asked, observer, uncertainty))

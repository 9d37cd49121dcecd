"""gamma_star by two algorithms that must agree, and observers close to it, best candidate first."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dob_companion.errors import NotConvergedError, UnsolvableError
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.estimation import EstimationProblem, estimation_problem
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.solve.lmi import LmiSolution, solve_lmi
from dob_companion.synthesis.solve.rest import Resting, resting
from dob_companion.synthesis.solve.riccati import bracket_gamma_star, central_filter
from dob_companion.synthesis.solve.scaling import FLOORS, WhiteProblem, whitened

AGREEMENT = 1e-3
"""The LMI and the Riccati equation must agree on gamma_star within this share …"""

GOOD_AGREEMENT = 1e-5
"""… and other coordinates are tried until they agree within this."""

BOTH = "smaller of Riccati infeasibility (bisection) and LMI dual (Clarabel)"
RICCATI = "Riccati infeasibility (bisection); LMI without answer"
WEAK = "Riccati infeasibility (bisection); LMI dual weaker"
LMI = "LMI dual (Clarabel); Riccati equation without answer"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Optimum:
    """A lower bound on what any observer reaches, how it was found, and what found it.

    `solution` is the LMI's, in the coordinates of `white`; `still` is there when modes of the problem are at rest.
    """

    gamma_star: float
    method: str
    problem: EstimationProblem
    white: WhiteProblem
    solution: LmiSolution | None
    still: Resting | None = None


def find_optimum(problem: Problem) -> Optimum:
    """Solve twice, in several coordinates until both agree.

    Raises UnsolvableError with the numbers when they never agree within AGREEMENT.
    """
    posed = estimation_problem(problem.plant, problem.disturbance_weight, problem.noise_weight, problem.delays)
    still = resting(posed, problem.disturbance_weight)
    return replace(_established(still.without), still=still) if still else _established(posed)


def _established(posed: EstimationProblem) -> Optimum:
    best, least, seen = None, np.inf, []
    for floor in FLOORS:
        try:
            white = whitened(posed, floor)
        except np.linalg.LinAlgError as trouble:
            seen.append(str(trouble))
            continue
        solution = solve_lmi(white.problem)
        bracket = _riccati(white, solution.gamma if solution else 1.0)
        found, gap = _judge(posed, white, solution, bracket)
        if found and gap < least:
            best, least = found, gap
        if least <= GOOD_AGREEMENT:
            break
        seen.append(_numbers(white, solution, bracket))
    if best is None or least > AGREEMENT:
        raise UnsolvableError(f"gamma_star could not be established: {'; '.join(seen)}")
    return best


def candidates(optimum: Optimum, backoff: float) -> Iterator[Any]:
    """Observers expected within backoff * gamma_star: central ones first, which do not ring, then the LMI's own."""
    if optimum.still is not None:
        for stirred in optimum.still.stirred():
            with contextlib.suppress(np.linalg.LinAlgError):
                yield from _central(optimum.gamma_star, backoff, stirred, whitened(stirred))
        return
    white, posed = optimum.white, optimum.problem
    yield from _central(optimum.gamma_star, backoff, posed, white)
    if optimum.solution is not None:
        yield posed.observer(*white.gains(optimum.solution.K, optimum.solution.K_z))


def _central(gamma_star: float, backoff: float, posed: EstimationProblem, white: WhiteProblem) -> Iterator[Any]:
    for share in (1.0, 0.5, 0.1):
        level = (1.0 + share * (backoff - 1.0)) * gamma_star / white.level
        found = central_filter(white.problem, level)
        if found is not None:
            yield posed.observer(*white.gains(found.K, found.K_z))


def _riccati(white: WhiteProblem, guess: float) -> tuple[float, float] | None:
    """The Riccati equation's bracket, in white units, its upper end measured; a bad guess costs time only."""
    try:
        return bracket_gamma_star(white.problem, guess)
    except ArithmeticError:
        return None


def _judge(
    posed: EstimationProblem, white: WhiteProblem, solution: LmiSolution | None, bracket: tuple[float, float] | None
) -> tuple[Optimum | None, float]:
    """What the two answers amount to, and how far they are apart (0.5 AGREEMENT when there is but one).

    A dual bound above a level that was measured as reached is refuted, one that is far below it says nothing.
    Infeasible levels of the Riccati equation are refuted where the LMI's own observer measures less.
    """

    def answer(level: float, method: str, gap: float) -> tuple[Optimum, float]:
        return Optimum(
            gamma_star=white.level * level, method=method, problem=posed, white=white, solution=solution
        ), gap

    dual = solution.dual_bound if solution else 0.0
    if bracket is not None:
        low, reached = bracket
        if solution is not None and low * (1.0 - AGREEMENT) <= dual <= reached * (1.0 + AGREEMENT):
            return answer(min(low, dual), BOTH, abs(dual / low - 1.0))
        if solution is None or _measured(white, solution) > low:
            return answer(low, RICCATI if solution is None else WEAK, 0.5 * AGREEMENT)
    if solution is not None and 0.0 < dual <= solution.gamma * (1.0 + AGREEMENT):
        return answer(dual, LMI, 0.5 * AGREEMENT + abs(solution.gamma / dual - 1.0))
    return None, np.inf


def _measured(white: WhiteProblem, solution: LmiSolution) -> float:
    """The norm that the LMI's observer has, in white units."""
    try:
        return hinf_norm(white.problem.error_system(solution.K, solution.K_z))[0]
    except NotConvergedError:
        return np.inf


def _numbers(white: WhiteProblem, solution: LmiSolution | None, bracket: tuple[float, float] | None) -> str:
    riccati = "no answer" if bracket is None else f"{white.level * bracket[0]:.6g}"
    dual = "no answer" if solution is None else f"{white.level * solution.dual_bound:.6g} ({solution.status})"
    return f"Riccati {riccati}, LMI dual {dual}"

"""An observer of lower order, when asked for: projected so that it stays deaf to commands, then certified anew.

Plain balanced truncation of D(z) would let commands leak into d_hat. Command invariance, D_y G + D_u = 0, says that
under a command alone the observer's state follows the plant's, x_D = T x_p, with

    A_D T + B_y C = T A,    B_u + B_y D = T B,    C_D T + D_y C = 0        (G = A, B, C, D)

Any projection whose range holds that of T keeps these equations, and with them the invariance, to rounding. The other
directions are ranked by balancing: how far disturbance and noise, weighted, drive them beside how much d_hat shows of
them (D. F. Enns, Proc. 23rd IEEE CDC, 1984). The projection is orthogonal in the observability Gramian's norm, in which
A_D is a contraction, so what is left of it is one too: the reduced observer is stable.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.artifact import Certificate
from dob_companion.errors import NotCertifiedError
from dob_companion.lti.gramian import gramian, gramian_root
from dob_companion.lti.response import spectral_radius
from dob_companion.synthesis.certify.certificate import Claim, certify
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.minimal import balanced
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.plant.problem import Problem

Array = NDArray[np.float64]

_RANK = 1e-9
"""Share of the largest singular value below which a direction of T counts as none."""


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """The observer in coordinates with observability Gramian 1: `basis` (n, n) orthogonal, what must stay first."""

    observer: Any
    basis: Array
    least: int

    def of_order(self, order: int) -> Any:
        """The observer on the first `order` directions, `least` <= order <= n."""
        V, D = self.basis[:, :order], self.observer
        return ct.ss(V.T @ D.A @ V, V.T @ D.B, D.C @ V, D.D, D.dt)


def projection(problem: Problem, observer: Any) -> Projection:
    """Directions of an observer D(z), inputs [y_n; u_e], in the order in which they should be kept."""
    _, sizes, Vt = np.linalg.svd(gramian_root(observer.A.T, observer.C.T).T)
    root = np.maximum(sizes, 1e-12 * sizes[:1])[:, None] * Vt
    back = np.linalg.inv(root)
    D = ct.ss(root @ observer.A @ back, root @ observer.B, observer.C @ back, observer.D, observer.dt)
    T = _follower(problem.plant, D)
    U, sizes, _ = np.linalg.svd(T, full_matrices=True)
    least = int(np.sum(sizes > _RANK * sizes[0])) if sizes.size else 0
    must, rest = U[:, :least], U[:, least:]
    _, ranked = np.linalg.eigh(rest.T @ _driven(problem, D, T) @ rest)
    return Projection(D, np.hstack([must, rest @ ranked[:, ::-1]]), least)


def certified_of_order(
    problem: Problem, observers: Iterable[Any], claim: Claim, order: int, exact: Callable[[Any], Any | None]
) -> tuple[Any, Certificate]:
    """The best reduction of `observers` to `order` states, and its certificate, which gains

    reduced_from            order of the observer that was reduced
    reduction_error         || D − D_reduced ||, H-infinity norm, from [y_n; u_e] to d_hat, measured
    reduction_error_floor   its Hankel singular value number order + 1: no stable system of that order is nearer
                            (K. Glover, Int. J. Control 39(6), 1984)

    Where no projection is certified, which rounding may do, `exact` has the last word: from an observer to the
    optimum itself, where that is known and has so few states.

    Raises NotCertifiedError with the measured gamma, and the smallest order that does, when none is certified.
    """
    full = [D for D in observers if D.nstates > order and spectral_radius(D.A) < 1.0]
    projections = [projection(problem, observer) for observer in full]
    tries: list[Callable[[int], Any | None]] = [
        lambda k: balanced(_of_order(projections[k], order)),
        lambda k: found if (found := exact(full[k])) is not None and found.nstates <= order else None,
    ]
    for attempt, k in product(tries, range(len(full))):
        try:
            reduced = attempt(k)
            if reduced is None:
                continue
            proof = certify(problem, reduced, claim)
        except NotCertifiedError:
            continue
        stated = {
            "reduced_from": full[k].nstates,
            "reduction_error": hinf_norm(full[k] - reduced)[0],
            "reduction_error_floor": float(_hankel_values(full[k])[reduced.nstates]),
        }
        return reduced, replace(proof, extra={**proof.extra, **stated})
    raise NotCertifiedError(_refusal(problem, projections, claim, order))


def _of_order(found: Projection, order: int) -> Any:
    if order < found.least:
        raise NotCertifiedError(f"command invariance needs {found.least} states")
    return found.of_order(order)


def _refusal(problem: Problem, projections: list[Projection], claim: Claim, order: int) -> str:
    least = min(found.least for found in projections)
    smallest = next(
        (
            k
            for k in range(order + 1, 1 + max(len(p.basis) for p in projections))
            if _any(problem, projections, claim, k)
        ),
        None,
    )
    does = "no order does" if smallest is None else f"the smallest order that does is {smallest}"
    if order < least:
        return f"an observer of order {order} cannot be deaf to commands, which takes {least} states; {does}"
    allowed = claim.backoff * claim.gamma_star
    gamma = min(_gamma(problem, found.of_order(order)) for found in projections if order >= found.least)
    return (
        f"reduced to order {order}: measured gamma {gamma:.7g}, expected at most {allowed:.7g} "
        f"(gamma_backoff * gamma_star) and every other proof to hold; {does}"
    )


def _any(problem: Problem, projections: list[Projection], claim: Claim, order: int) -> bool:
    for found in projections:
        try:
            certify(problem, balanced(_of_order(found, min(order, len(found.basis)))), claim)
        except NotCertifiedError:
            continue
        return True
    return False


def _gamma(problem: Problem, observer: Any) -> float:
    loop = close_loop(problem.plant, problem.controller, observer, problem.delays)
    return hinf_norm(loop.part("error", "d", "n") * stack([problem.disturbance_weight, problem.noise_weight]))[0]


def _follower(plant: Any, D: Any) -> Array:
    """T (n_D, n_G) of the three equations above, all at once by least squares: plant and observer may share poles."""
    p, (n, n_p) = plant.D.shape[0], (D.nstates, plant.nstates)
    B_y, B_u, D_y = D.B[:, :p], D.B[:, p:], D.D[:, :p]
    rows = np.vstack(  # on vec T, columns stacked: vec(X T Y) = (Y' ⊗ X) vec T
        [
            np.kron(plant.A.T, np.eye(n)) - np.kron(np.eye(n_p), D.A),
            np.kron(plant.B.T, np.eye(n)),
            np.kron(np.eye(n_p), D.C),
        ]
    )
    right = [B_y @ plant.C, B_u + B_y @ plant.D, -D_y @ plant.C]
    found = np.linalg.lstsq(rows, np.concatenate([block.flatten(order="F") for block in right]), rcond=None)[0]
    return np.asarray(found.reshape((n, n_p), order="F"))


def _driven(problem: Problem, D: Any, T: Array) -> Array:
    """Gramian (n, n) of xi = x_D − T x_p, which commands do not move, under d = W_d w_d and n = W_n w_n."""
    plant, n = problem.plant, D.nstates
    B_y = D.B[:, : plant.D.shape[0]]
    estimator = ct.ss(D.A, np.hstack([B_y @ plant.D - T @ plant.B, B_y]), np.eye(n), 0, D.dt)
    driven = estimator * ct.append(problem.disturbance_weight, problem.noise_weight)
    return np.asarray(driven.C @ gramian(driven.A, driven.B) @ driven.C.T + driven.D @ driven.D.T)


def _hankel_values(system: Any) -> Array:
    reach, show = gramian_root(system.A, system.B), gramian_root(system.A.T, system.C.T)
    return np.asarray(linalg.svdvals(show.T @ reach))

"""Robust stability and worst-case performance of a design over its stated uncertainty: bounds, and samples below them.

Bounds: the set is cut into cells, each covered by a disk at every frequency (`cells.py`) for which a scaled
mu bound holds (`interconnection.py`); the worst cell is halved until the bound meets what sampled plants reach
(branch and bound, as Newlin and Young, Int. J. Robust Nonlinear Control 7, 1997, for real mu). Stability is by
zero exclusion: a connected set of plants with one stable loop, none of whose members puts a closed-loop pole on the
unit circle at any frequency, is stable altogether. Each combination of delays is such a set.

Frequencies are a grid. For stability every step of it is covered: the loop's change to the next angle counts against
the bound (`Interconnection.crossing`), and GUARD on top. For gamma the grid is evaluated, then its midpoints, and the
bound is raised by twice what the midpoints added (`grid_guard`), at least by GUARD.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import SpecError
from dob_companion.lti.response import largest, response, spectral_radius
from dob_companion.synthesis.norms.hinf import angle_grid, hinf_norm
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.robust.cells import Cell, Sample, disks, factor_system, first_cells, mode_root, samples
from dob_companion.synthesis.robust.destabilize import destabilized
from dob_companion.synthesis.robust.interconnection import Interconnection, interconnect
from dob_companion.synthesis.spec.uncertainty import Uncertainty

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Bound = Callable[[Interconnection, Cell, ComplexArray, Array], Array]
"""Of a cell over the angles of a grid."""

GRID = 600
GUARD = 1e-3
TIGHT = 0.02
"""Cells are cut until the bound is within this share of a sampled plant …"""

MOST_CELLS = 300
"""… or this many have been looked at."""

INTERIOR, SEED, PHASES = 60, 20190716, 8
FARTHEST = 8.0
"""The searches for safe and unsafe factors end here, or where the set has no meaning (gain 0, an unstable pole)."""

FACTOR_STEP = 0.01
"""Relative width to which the safe and the unsafe factor are bisected."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Robustness:
    """What is proved and what was seen.

    safe_factor is the largest k for which the set k times as wide as stated is proved stable, unsafe_factor the
    smallest for which a plant in it was found unstable (None up to `farthest`). The gains (w_d, w_n) -> e are those of
    the model, the greatest of the sampled plants (`worst`), and a bound for all; the last two are None unless the
    stated set is proved stable.
    """

    safe_factor: float
    unsafe_factor: float | None
    farthest: float
    gamma_nominal: float
    gamma_sampled: float | None
    gamma_bound: float | None
    grid_guard: float
    cells: int
    worst: Sample

    @property
    def stable(self) -> bool:
        """Whether every plant of the stated set is proved stable."""
        return self.safe_factor >= 1.0

    @property
    def mu_bound(self) -> float:
        """1 / safe_factor: an upper bound of mu over the stated set."""
        return 1.0 / self.safe_factor

    def record(self) -> dict[str, object]:
        """The findings as a certificate keeps them, under robust_* keys; what does not exist is left out."""
        found: dict[str, object] = {
            "robust_stable": self.stable,
            "robust_mu_bound": self.mu_bound,
            "robust_safe_factor": self.safe_factor,
            "robust_unsafe_factor": self.unsafe_factor,
            "robust_farthest_factor": self.farthest,
            "robust_gamma_nominal": self.gamma_nominal,
            "robust_gamma_sampled": self.gamma_sampled,
            "robust_gamma_bound": self.gamma_bound,
            "robust_grid_guard": self.grid_guard,
            "robust_cells": self.cells,
            "robust_worst": [
                [*values, float(late)] for values, late in zip(self.worst.values, self.worst.delays, strict=True)
            ],
        }
        return {name: value for name, value in found.items() if value is not None}


def analyse(problem: Problem, observer: Any, uncertainty: Uncertainty) -> Robustness:
    """Robust stability and the worst gain (w_d, w_n) -> d - z^-tau d_hat of an observer over an uncertainty.

    Raises SpecError when an uncertain pole or mode is not one of the plant's.
    """
    require_in_plant(problem.plant, uncertainty)
    grids = _grids(problem, observer, uncertainty)
    seen = samples(uncertainty, INTERIOR, SEED)
    farthest = _farthest(uncertainty)
    unsafe = _unsafe_factor(problem, observer, uncertainty, farthest, grids[0])
    safe = _safe_factor(problem, observer, uncertainty, unsafe or farthest, grids)
    peaks = _sampled(grids[:2], uncertainty, seen)
    worst = seen[int(np.argmax(peaks))]
    sampled, bound, guard, cells = None, None, 0.0, 0
    if safe >= 1.0:
        sampled = max(hinf_norm(error_of(problem, observer, uncertainty, worst))[0], float(np.max(peaks)))
        bound, guard, cells = _performance(grids, uncertainty, sampled)
    nominal = max(_peak(grid.M22) for grid in grids[:2])
    return Robustness(
        safe_factor=safe,
        unsafe_factor=unsafe,
        farthest=farthest,
        gamma_nominal=nominal,
        gamma_sampled=sampled,
        gamma_bound=bound,
        grid_guard=guard,
        cells=cells,
        worst=worst,
    )


def worth(problem: Problem, observer: Any, uncertainty: Uncertainty) -> tuple[bool, float]:
    """For a search, less is better: (False, bound of gamma) when proved stable, else (True, -safe_factor)."""
    require_in_plant(problem.plant, uncertainty)
    grids = _grids(problem, observer, uncertainty)
    if _proved(grids, problem, observer, uncertainty):
        sampled = _sampled(grids[:2], uncertainty, samples(uncertainty, 0, SEED, 32))
        bound, _, _ = _performance(grids, uncertainty, float(np.max(sampled)))
        return (True, -1.0) if bound is None else (False, bound)
    return True, -_safe_factor(problem, observer, uncertainty, 1.0, grids)


def safe_factor(problem: Problem, observer: Any, uncertainty: Uncertainty, end: float) -> float:
    """Largest k up to `end` for which the set scaled by k is proved stable."""
    require_in_plant(problem.plant, uncertainty)
    return _safe_factor(problem, observer, uncertainty, end, _grids(problem, observer, uncertainty))


def error_of(problem: Problem, observer: Any, uncertainty: Uncertainty, sample: Sample) -> Any:
    """(w_d, w_n) -> d - z^-tau d_hat as a state-space system of one sampled plant, wired anew."""
    plant = problem.plant * factor_system(uncertainty, sample, problem.dt)
    loop = close_loop(plant, problem.controller, observer, problem.delays)
    return loop.part("error", "d", "n") * stack([problem.disturbance_weight, problem.noise_weight])


def require_in_plant(plant: Any, uncertainty: Uncertainty) -> None:
    """Every nominal pole and mode must be one of the plant's."""
    poles = np.linalg.eigvals(plant.A)
    for channel in uncertainty.channels:
        named = [(f"pole {pole.nominal:g}", complex(pole.nominal)) for pole in channel.poles]
        named += [
            (f"mode of {m.frequency_hz.nominal:g} Hz", mode_root(m.frequency_hz.nominal, m.damping.nominal, plant.dt))
            for m in channel.modes
        ]
        for name, root in named:
            nearest = complex(poles[np.argmin(np.abs(poles - root))]) if poles.size else complex(np.nan)
            if not abs(nearest - root) <= 1e-3:
                raise SpecError(
                    f"uncertainty: {name} (z = {root:.5g}): expected a pole of the plant; the nearest is {nearest:.5g}"
                )


def _grids(problem: Problem, observer: Any, uncertainty: Uncertainty) -> tuple[Interconnection, ...]:
    """Angles close around every resonance of the loop and every place a mode may be; their midpoints; a denser grid."""
    loop = close_loop(problem.plant, problem.controller, observer, problem.delays)
    marks = [angle_grid(loop.system.A, GRID)]
    for channel in uncertainty.channels:
        hertz = 2.0 * np.pi * problem.dt
        marks += [np.linspace(m.frequency_hz.low, m.frequency_hz.high, 40) * hertz for m in channel.modes]
        marks.append(np.array(channel.frequency_hz) * hertz)
    coarse = np.unique(np.clip(np.concatenate(marks), 0.0, np.pi))
    fine = (coarse[1:] + coarse[:-1]) / 2.0
    both = np.union1d(coarse, fine)
    dense = np.union1d(both, (both[1:] + both[:-1]) / 2.0)
    return tuple(interconnect(problem, observer, angles) for angles in (coarse, fine, dense))


def _sampled(grids: tuple[Interconnection, ...], uncertainty: Uncertainty, seen: list[Sample]) -> Array:
    """Peak over frequency of the gain w -> e of each sample.

    A w of the full multiplicative size is tried at PHASES phases at each frequency: some stable w has that one there.
    """
    peaks = np.zeros(len(seen))
    for grid in grids:
        hertz = grid.angles / (2.0 * np.pi * grid.dt)
        sizes = [np.interp(hertz, c.frequency_hz or (0.0,), c.multiplicative or (0.0,)) for c in uncertainty.channels]
        w = np.stack(sizes, axis=1)
        turns = np.exp(2j * np.pi * np.arange(PHASES) / PHASES) if np.any(w) else np.zeros(1)
        for k, sample in enumerate(seen):
            phi = np.diagonal(response(factor_system(uncertainty, sample, grid.dt), grid.angles), axis1=1, axis2=2)
            peaks[k] = max(peaks[k], *(_peak(grid.closed(phi * (1.0 + turn * w))) for turn in turns))
    return peaks


def _peak(G: ComplexArray) -> float:
    return float(np.max(largest(G)))


def _performance(
    grids: tuple[Interconnection, ...], uncertainty: Uncertainty, sampled: float
) -> tuple[float | None, float, int]:
    """Bound of gamma, its grid guard, and the number of cells it took; None when no bound was found."""
    target = sampled * (1.0 + TIGHT)
    (peak, cells), (between, more) = (_branch(grid, uncertainty, _gammas, target) for grid in grids[:2])
    if not np.isfinite(max(peak, between)):
        return None, 0.0, cells + more
    guard = max(GUARD, 2.0 * (between / peak - 1.0))
    return max(peak, between) * (1.0 + guard), guard, cells + more


def _proved(grids: tuple[Interconnection, ...], problem: Problem, observer: Any, uncertainty: Uncertainty) -> bool:
    """Whether no plant of the set is unstable: one member of each connected part is not, and none can cross over."""
    for delays in {cell.delays for cell in first_cells(uncertainty)}:
        centre = Sample(tuple(tuple(p.nominal for p in c.intervals) for c in uncertainty.channels), delays)
        if not _is_stable(problem, observer, factor_system(uncertainty, centre, problem.dt)):
            return False
    return _branch(grids[2], uncertainty, _crossings, 1.0 - GUARD)[0] <= 1.0 - GUARD


def _crossings(grid: Interconnection, cell: Cell, centres: ComplexArray, radii: Array) -> Array:
    return grid.crossing(centres, radii, disks(cell, grid.next_angles, grid.dt)[0])


def _gammas(grid: Interconnection, _: Cell, centres: ComplexArray, radii: Array) -> Array:
    return grid.bounds(centres, radii)[1]


def _branch(grid: Interconnection, uncertainty: Uncertainty, bound: Bound, target: float) -> tuple[float, int]:
    """Halve the worst cell until its `bound` is at most `target` at every angle, or can be cut no more.

    Returns the largest bound and how many cells were looked at. An angle at which a cell keeps to the target is
    settled for its halves too, which are part of it.
    """
    settled = 0.0

    def look(cell: Cell, index: NDArray[np.intp]) -> tuple[float, Cell, NDArray[np.intp], tuple[int, int] | None]:
        nonlocal settled
        part = grid.at(index)
        with np.errstate(all="ignore"):
            centres, radii, shares = disks(cell, part.angles, part.dt)
            values = bound(part, cell, centres, radii)
        worst, still = int(np.argmax(values)), values > target
        settled = max(settled, float(np.max(values[~still], initial=0.0)))
        cut = max(shares, key=lambda share: float(share[2][worst]))[:2] if shares else None
        return float(values[worst]), cell, index[still], cut

    leaves = [look(cell, np.arange(len(grid.angles))) for cell in first_cells(uncertainty)]
    looked = len(leaves)
    while looked < MOST_CELLS:
        k = max(range(len(leaves)), key=lambda i: leaves[i][0])
        value, cell, still, cut = leaves[k]
        if value <= target or cut is None:
            break
        leaves[k : k + 1] = [look(half, still) for half in cell.halves(*cut)]
        looked += 2
    return max(settled, *(leaf[0] for leaf in leaves)), looked


def _safe_factor(
    problem: Problem, observer: Any, uncertainty: Uncertainty, end: float, grids: tuple[Interconnection, ...]
) -> float:
    """Largest k for which the set scaled by k is proved stable; the stated set itself (k = 1) is always tried."""

    def proved(k: float) -> bool:
        scaled = uncertainty.scaled(k)
        return scaled is not None and _proved(grids, problem, observer, scaled)

    if proved(end):
        return end
    low, high = (1.0, end) if end > 1.0 and proved(1.0) else (0.0, min(end, 1.0))
    while high - low > FACTOR_STEP * high and high > 1e-6:
        middle = (low + high) / 2.0
        low, high = (middle, high) if proved(middle) else (low, middle)
    return low


def _unsafe_factor(
    problem: Problem, observer: Any, uncertainty: Uncertainty, farthest: float, grid: Interconnection
) -> float | None:
    """Smallest k found at which a plant of the scaled set (its vertices, a destabilizing w) is unstable."""

    def upset(k: float) -> bool:
        scaled = uncertainty.scaled(k)
        if scaled is None:
            return False
        for sample in samples(scaled, 0, SEED, 32):
            factor = factor_system(scaled, sample, problem.dt)
            if not all(_is_stable(problem, observer, one) for one in (factor, *destabilized(grid, scaled, factor))):
                return True
        return False

    low = 0.0
    for high in np.unique(np.append(np.geomspace(0.25, farthest, 16), farthest)):
        if upset(float(high)):
            break
        low = float(high)
    else:
        return None
    high = float(high)
    while high - low > FACTOR_STEP * high:
        middle = (low + high) / 2.0
        low, high = (low, middle) if upset(middle) else (middle, high)
    return high


def _farthest(uncertainty: Uncertainty) -> float:
    """Largest factor, at most FARTHEST, for which the scaled set has a meaning."""
    if uncertainty.scaled(FARTHEST) is not None:
        return FARTHEST
    low, high = 1.0, FARTHEST
    while high - low > 1e-3:
        middle = (low + high) / 2.0
        low, high = (low, middle) if uncertainty.scaled(middle) is None else (middle, high)
    return low


def _is_stable(problem: Problem, observer: Any, factor: Any) -> bool:
    loop = close_loop(problem.plant * factor, problem.controller, observer, problem.delays)
    return spectral_radius(loop.system.A) < 1.0

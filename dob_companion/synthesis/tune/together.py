"""The best observer of coupled axes for what [auto] asks, and the full-block weights of which it is the optimum.

The poles of each output are those of the best observer of its axis alone, as if the others were not there, or generic
ones where these serve better; numerators follow from one convex programme for all axes (`optimal/coupled.py`).
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import control as ct
import numpy as np

from dob_companion.artifact import DobBlock
from dob_companion.errors import DobError, NotCertifiedError, UnsolvableError
from dob_companion.lti.response import response
from dob_companion.synthesis.design import design_block
from dob_companion.synthesis.optimal.asked import spectrum_of
from dob_companion.synthesis.optimal.bound import AttenuationLimits
from dob_companion.synthesis.optimal.coupled import Programme, Row, Solved
from dob_companion.synthesis.optimal.coupled_weights import coupled_weights
from dob_companion.synthesis.optimal.poles import free
from dob_companion.synthesis.optimal.problem import Axis, Block, Wanted
from dob_companion.synthesis.optimal.reached import reads_well
from dob_companion.synthesis.optimal.search import MOST_ORDER, Search
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.models import from_data, to_state_space
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.plant.solvability import require_solvable
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import BlockSpec, Matrices, Model, Weight, Zpk
from dob_companion.synthesis.tune.best import APART, BACKOFF, HELPS, MARGINS
from dob_companion.synthesis.tune.limits import Limits, Tuning
from dob_companion.synthesis.tune.limits import Row as Line
from dob_companion.synthesis.tune.yardstick import Measured, Yardstick, as_certified

ORDER = 4
"""States for each output, where the plant needs no more and the spec states no largest order."""

SLACKS = (1.002, 1.01, 1.05)
"""The programme keeps clear of the limits by the first factor; by more when the certificate still says otherwise."""

GENERIC = (0.1, 0.75)
"""Least and greatest angle of generic poles, rad per sample."""


class _Choice:
    """One block on its way."""

    def __init__(self, block: BlockSpec, dt: float, auto: AutoSpec) -> None:
        size = len(block.axes)
        self.block, self.dt, self.auto, self.asked = block, dt, auto, Limits.of(auto)
        self.plant = minimal(to_state_space(block.plant, dt, (size, size)))
        self.controller = minimal(to_state_space(block.controller, dt, (size, size)))
        self.delays, one = (block.delay_samples,) * size, ct.ss([], [], [], np.eye(size), dt)
        require_solvable(Problem(self.plant, self.controller, one, one, self.delays), block.axes)
        self.yardstick = Yardstick(self.plant, self.controller, self.delays, auto)
        self.posed = Block(self.plant, self.controller, self.delays, auto.attitude_gain)
        self.spectrum = spectrum_of(auto)
        self.bounds = AttenuationLimits(self.posed, self.spectrum, auto.noise_rms)
        self.least = least = -(-(self.plant.nstates + 1) // size)  # for each output to have something free
        self.order = max(ORDER, least)
        if block.largest_order is not None:
            self.order = min(max(MOST_ORDER, least), block.largest_order // size)
        if self.order < least:
            raise UnsolvableError(
                f"largest_order is {block.largest_order}: an observer of these axes has {least * size} states at "
                "least (link delay not counted)"
            )

    def poles(self, limits: Limits) -> Iterator[tuple[Any, ...]]:
        """Sets of poles to try, free numbers for each output."""
        wanted = limits.wanted(self.auto, SLACKS[0])
        radius = float(np.exp(-self.dt / wanted.slowest_s))
        generic = free(np.exp(-np.geomspace(*GENERIC, self.order)).astype(complex), radius)
        yield (generic,) * len(self.delays)
        alone = [self._alone(i, wanted) for i in range(len(self.delays))]
        if any(x is not None for x in alone):
            yield tuple(generic if x is None else x for x in alone)

    def _alone(self, i: int, wanted: Wanted) -> Any:
        try:
            axis = Axis.of(
                minimal(self.plant[i, i]), minimal(self.controller[i, i]), self.delays[i], self.auto.attitude_gain
            )
        except DobError:
            return None
        found = Search(axis, self.spectrum, self.order).best(wanted) if axis.order + 2 <= self.order else None
        return found.solved.x if found is not None and len(found.solved.x) >= self.least else None

    def solve(self, limits: Limits, slack: float, poles: tuple[Any, ...]) -> tuple[Programme, Solved | None]:
        """The best numerators for these poles."""
        programme = Programme(self.posed, self.spectrum, limits.wanted(self.auto, slack))
        return programme, programme.solve(tuple(Row.of(self.plant, x, programme.radius) for x in poles))

    def best(self) -> tuple[tuple[Any, ...], Solved]:
        """Poles and observer. Raises UnsolvableError when nothing keeps the limits and attenuates."""
        found = self.best_of(self.asked, self.poles(self.asked))
        if found is None or found[1].value * HELPS > 1.0:
            asked = self.asked
            raise UnsolvableError(
                f"no observer of {self.order} states for each axis has disk margin >= {asked.disk_margin:.3g}, delay "
                f"margin >= {asked.delay_margin:g}, noise in the correction <= {asked.noise:.3g}, slowest mode <= "
                f"{asked.slowest_s:.3g} s and attenuates; without observer the disk margin is "
                f"{self.yardstick.disk_margin_off:.3g}"
            )
        return found

    def best_of(self, limits: Limits, sets: Iterable[tuple[Any, ...]]) -> tuple[tuple[Any, ...], Solved] | None:
        """The poles of the best observer and that; None where nothing keeps the limits."""
        tried = [(poles, self.solve(limits, SLACKS[0], poles)[1]) for poles in sets]
        found = [(poles, solved) for poles, solved in tried if solved is not None]
        return min(found, key=lambda each: each[1].value, default=None)

    def measured(self, observer: Any) -> Measured | None:
        """By the yardstick; None for an unstable observer."""
        found = self.yardstick.measure(observer)
        if found is None:
            return None
        programme = Programme(self.posed, self.spectrum, self.asked.wanted(self.auto, 1.0))
        X = response(observer, programme.angles)[:, :, : self.plant.D.shape[0]]
        at = [programme.attenuation(X, gain) for gain in (1.0, *self.auto.gains)]
        return replace(found, attenuation=at[0], at_gains=tuple(at[1:]))

    def proved(self, block: DobBlock) -> Measured:
        """A designed block by the yardstick, and by its certificate where that knows better."""
        return as_certified(self.measured(from_data(block.observer, self.dt)), block.certificate)

    def rows(self, poles: tuple[Any, ...], best: Solved) -> tuple[Line, ...]:
        """The trade-off, each row on the better of these poles and its own; one for stricter limits counts in every
        looser row, so none of these has less."""
        asked, off = self.asked, self.yardstick.disk_margin_off
        below = [m for m in MARGINS if m * APART < asked.disk_margin][-1:]
        above = [m for m in MARGINS if asked.disk_margin * APART < m < off / APART][:2]
        others = [replace(asked, disk_margin=margin) for margin in (*below, *above)]
        others += [replace(asked, noise=share * asked.noise) for share in (0.5, 0.25)]
        tried = [best, *(found[1] for each in others if (found := self.best_of(each, [poles, *self.poles(each)])))]
        known = [(each.value, m) for each in tried if (m := self.measured(each.observer(self.plant)))]
        rows = []
        for limits in others:
            kept = [each for each in known if limits.excess(each[1]) == 0.0]
            _, m = min(kept, key=lambda each: each[0], default=(np.inf, None))
            if m is not None and m.attenuation > HELPS:
                rows.append(Line(limits, m, self.limit(limits)))
        return tuple(sorted(rows, key=lambda row: (row.asked.disk_margin, row.asked.noise)))

    def limit(self, asked: Limits) -> float | None:
        """No observer of any order attenuates more within these limits."""
        return self.bounds.of(asked.wanted(self.auto, 1.0))

    def designed(self, poles: tuple[Any, ...]) -> tuple[Matrices, Zpk, DobBlock, Measured]:
        """Weights, and the block solved with them and certified, keeping the limits."""
        trouble: Exception = UnsolvableError("the observer found has no weights of its own")
        rates = self.plant.D.shape[0]
        for slack in SLACKS:
            _, solved = self.solve(self.asked, slack, poles)
            found = coupled_weights(solved.observer(self.plant), rates, self.delays[0]) if solved else None
            if solved is None or found is None:
                continue
            W_d, c = _matrices(found[0]), Zpk((), (), float(found[1].D[0, 0]))
            for order in self._orders(sum(len(x) for x in poles)):
                try:
                    block = design_block(self._weighted(W_d, c, order), self.dt)
                    chosen = self.proved(block)
                except (NotCertifiedError, UnsolvableError) as failure:
                    trouble = failure
                    continue
                if self.asked.excess(chosen) == 0.0 and reads_well(block, self.dt, self.auto):
                    return W_d, c, block, chosen
                break
        raise trouble

    def _orders(self, own: int) -> list[int | None]:
        """Largest orders to reduce to: the optimum's own, a few states more where rounding spoils that, then any."""
        stated = self.block.largest_order
        return [own, own + len(self.delays), None] if stated is None else [own, *({stated} - {own})]

    def _weighted(self, W_d: Matrices, c: Zpk, order: int | None) -> BlockSpec:
        where = f"{self.block.where}: weights"
        return replace(
            self.block,
            disturbance=Weight(f"{where}: disturbance", Model(W_d, where)),
            noise=Weight(f"{where}: noise", Model(c, where)),
            gamma_backoff=BACKOFF,
            largest_order=order,
        )


def _matrices(system: Any) -> Matrices:
    def rows(M: Any) -> tuple[tuple[float, ...], ...]:
        return tuple(tuple(float(x) for x in row) for row in np.asarray(M))

    return Matrices(rows(system.A), rows(system.B), rows(system.C), rows(system.D))


def coupled_design(block: BlockSpec, dt: float, auto: AutoSpec) -> tuple[DobBlock, Tuning]:
    """A block of several axes, designed, and how its weights were found.

    Raises UnsolvableError when there is no observer, or none that keeps the limits, and NotCertifiedError.
    """
    choice = _Choice(block, dt, auto)
    poles, best = choice.best()
    W_d, c, designed, chosen = choice.designed(poles)
    order = len(designed.observer.A)
    own = None
    if block.disturbance is not None and block.noise is not None:
        own = choice.proved(design_block(replace(block, largest_order=None, uncertainty=None), dt))
    return designed, Tuning(
        name=block.name,
        auto=auto,
        asked=choice.asked,
        chosen=chosen,
        rows=choice.rows(poles, best),
        own=own,
        disk_margin_off=choice.yardstick.disk_margin_off,
        disturbance=W_d,
        noise=(c,) * len(block.axes),
        gamma_backoff=BACKOFF,
        order=order,
        limited_by=choice.asked.binding(chosen),
        form=f"{order} states; W_d of order {len(W_d.A)} over all axes, W_n constant",
        limit=choice.limit(choice.asked),
    )

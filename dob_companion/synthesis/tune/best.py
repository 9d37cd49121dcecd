"""The best observer of one axis for what [auto] asks, and the weights of which it is the H-infinity optimum.

`optimal/` finds it. Its weights then go the way of all weights: solved by LMI and Riccati equation, reduced to the
states that the optimum has, certified. What is flown is that result: a spec that states the weights gives it again.
"""

from dataclasses import replace
from typing import Any

import control as ct

from dob_companion.artifact import DobBlock
from dob_companion.errors import NotCertifiedError, UnsolvableError
from dob_companion.lti.response import response
from dob_companion.synthesis.design import design_block
from dob_companion.synthesis.optimal.asked import spectrum_of
from dob_companion.synthesis.optimal.bound import AttenuationLimits
from dob_companion.synthesis.optimal.problem import Axis, Block, attenuation
from dob_companion.synthesis.optimal.reached import reads_well
from dob_companion.synthesis.optimal.realization import Weights, weights
from dob_companion.synthesis.optimal.search import Found, Search, allowed_order
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.models import from_data, to_state_space
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.plant.solvability import require_solvable
from dob_companion.synthesis.robust.programme import borne, factors
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import BlockSpec, Model, Weight
from dob_companion.synthesis.spec.uncertainty import Uncertainty
from dob_companion.synthesis.tune.limits import Limits, Row, Tuning
from dob_companion.synthesis.tune.yardstick import Measured, Yardstick, as_certified

BACKOFF = 1.0003
"""How near to gamma* the weights are solved: there is one optimum, and this near to it an observer is the same to four
digits. A solver tells gamma* to 1e-5."""

SLACKS = (1.001, 1.005, 1.03)
"""The search keeps clear of the limits by the first factor, more than BACKOFF and a grid of angles take; by more when
the certificate still says otherwise."""

MARGINS = (0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4, 1.6)
LOOSER, STRICTER, QUIETER = 1, 3, 2
"""Disk margins for which the trade-off is shown: so many below and above the one asked for, and so many steps of less
noise. They are round and no shares of what was asked, so that other limits meet the same ones."""

APART = 1.03
"""A row differs from what was asked by this factor at least."""

HELPS = 1.001
"""Attenuation from which on an observer is worth its states."""


NO_WEIGHTS = (
    "observers within the limits were found, but none with weights of its own: what is left of a disturbance, "
    "1 - z^-τ Q, has zeros outside the unit circle (a sharp mode close to the band, as a rule); ask for less noise in "
    "the correction, so that the observer does less there"
)


class _Choice:
    """One block on its way."""

    def __init__(self, block: BlockSpec, dt: float, auto: AutoSpec) -> None:
        self.block, self.dt, self.auto, self.asked = block, dt, auto, Limits.of(auto)
        self.plant = minimal(to_state_space(block.plant, dt, (1, 1)))
        self.controller = minimal(to_state_space(block.controller, dt, (1, 1)))
        delays, one = (block.delay_samples,), ct.ss([], [], [], [[1.0]], dt)
        require_solvable(Problem(self.plant, self.controller, one, one, delays), block.axes)
        self.yardstick = Yardstick(self.plant, self.controller, delays, auto)
        self.axis = Axis.of(self.plant, self.controller, block.delay_samples, auto.attitude_gain)
        self.spectrum = spectrum_of(auto)
        self.search = Search(self.axis, self.spectrum, self._order())
        if (uncertain := block.uncertainty) and uncertain.synthesis == "robust":
            asked = Problem(self.plant, self.controller, one, one, delays)
            self.search.factors = factors(self.search.on, uncertain, borne(asked, uncertain), 0)
        posed = Block(self.plant, self.controller, delays, auto.attitude_gain)
        self.bounds = AttenuationLimits(posed, self.spectrum, auto.noise_rms)

    def _order(self) -> int:
        """States at most."""
        least, stated = self.axis.order, self.block.largest_order
        if stated is not None and stated < least:
            raise UnsolvableError(
                f"largest_order is {stated}: an observer of this plant has its order, {least}, at least "
                "(link delay not counted)"
            )
        return allowed_order(self.axis, stated)

    def measured(self, observer: Any) -> Measured | None:
        """By the yardstick; None for an unstable observer."""
        found, on = self.yardstick.measure(observer), self.search.on
        if found is None:
            return None
        F = response(observer, on.angles)[:, 0, 0] / on.M
        at = [attenuation(on, self.spectrum, self.auto.noise_rms, F, gain) for gain in (1.0, *self.auto.gains)]
        return replace(found, attenuation=at[0], at_gains=tuple(at[1:]))

    def proved(self, block: DobBlock) -> Measured:
        """A designed block by the yardstick, and by its certificate where that knows better."""
        return as_certified(self.measured(from_data(block.observer, self.dt)), block.certificate)

    def others(self) -> list[Limits]:
        """Limits around those asked for."""
        asked, off = self.asked, self.yardstick.disk_margin_off
        below = [m for m in MARGINS if m * APART < asked.disk_margin][-LOOSER:]
        above = [m for m in MARGINS if asked.disk_margin * APART < m < off / APART][:STRICTER]
        return [replace(asked, disk_margin=margin) for margin in (*below, *above)]

    def quieter(self, found: Found) -> list[Limits]:
        """Less noise than the best makes, in steps of 1, 2 and 5."""
        noise = self.measured(found.observer(self.axis))
        if noise is None:
            return []
        steps = [digit * 10.0**decade for decade in range(-12, 2) for digit in (1.0, 2.0, 5.0)]
        quiet = [step for step in steps if step * APART < min(noise.noise, self.asked.noise)][-QUIETER:]
        return [replace(self.asked, noise=step) for step in quiet]

    def front(self) -> tuple[Found, tuple[Row, ...]]:
        """The best for what is asked, and the trade-off around it. Raises UnsolvableError."""
        slack = SLACKS[0]
        first = self.search.best(self.asked.wanted(self.auto, slack))
        if first is None or first.solved.value * HELPS > 1.0:
            raise UnsolvableError(self.refusal())
        first = self.search.weighable(first)
        if first is None:
            raise UnsolvableError(NO_WEIGHTS)
        limits = [*self.others(), *self.quieter(first)]
        best, *found = self.search.front(first, [each.wanted(self.auto, slack) for each in limits])
        best = self.search.weighable(best or first) or first
        rows = []
        for asked, each in zip(limits, found, strict=True):
            m = self.measured(each.observer(self.axis)) if each else None
            if m is not None and m.attenuation > HELPS:
                rows.append(Row(asked, m, self.limit(asked)))
        return best, tuple(sorted(rows, key=lambda row: (row.asked.disk_margin, row.asked.noise)))

    def limit(self, asked: Limits) -> float | None:
        """No observer of any order attenuates more within these limits."""
        return self.bounds.of(asked.wanted(self.auto, 1.0))

    def own(self) -> Measured | None:
        """The spec's own weights by the same yardstick, when it has any."""
        if self.block.disturbance is None or self.block.noise is None:
            return None
        return self.proved(design_block(replace(self.block, largest_order=None, uncertainty=None), self.dt))

    def designed(self, best: Found) -> tuple[Weights, DobBlock, Measured]:
        """Weights, and the block solved with them and certified, keeping the limits.

        Raises UnsolvableError and NotCertifiedError.
        """
        trouble: Exception | None = None
        for slack in SLACKS:
            tight = best if slack == SLACKS[0] else self.search.nearby(best, self.asked.wanted(self.auto, slack))
            found = weights(self.axis, tight.observer(self.axis)) if tight else None
            if tight is None or found is None:
                continue
            for order in self._orders(tight.order):
                try:
                    block = design_block(self._weighted(found, order), self.dt)
                except (NotCertifiedError, UnsolvableError) as failure:
                    trouble = failure
                    continue
                chosen = self.proved(block)
                if self.asked.excess(chosen) == 0.0 and self._is_quiet(block) and reads_well(block, self.dt, self.auto):
                    return found, block, chosen
                trouble = UnsolvableError(_missed(chosen))
                break
        raise trouble or UnsolvableError(NO_WEIGHTS)

    def _orders(self, own: int) -> list[int | None]:
        """Largest orders to reduce to: the optimum's own, a few more where rounding spoils that, as it may for a
        plant with sharp resonances, then any."""
        stated = self.block.largest_order
        return [own, own + 2, None] if stated is None else [own, *({stated} - {own})]

    def _weighted(self, found: Weights, order: int | None) -> BlockSpec:
        where = f"{self.block.where}: weights"
        return replace(
            self.block,
            disturbance=Weight(f"{where}: disturbance", Model(found.disturbance, where)),
            noise=Weight(f"{where}: noise", Model(found.noise, where)),
            gamma_backoff=BACKOFF,
            largest_order=order,
            uncertainty=analysed(self.block.uncertainty),
        )

    def _is_quiet(self, block: DobBlock) -> bool:
        peak = block.certificate.extra["noise_to_estimate_peak"]
        return self.auto.largest_peak is None or (isinstance(peak, float) and peak <= self.auto.largest_peak)

    def refusal(self) -> str:
        """Why nothing keeps the limits, and which of them stands in the way."""
        asked, auto = self.asked.wanted(self.auto, SLACKS[0]), self.auto
        loosened = {
            f"disk margin >= {auto.least_disk_margin:.3g}": replace(asked, disk_margin=1e-3),
            f"delay margin >= {auto.least_delay_margin:g}": replace(asked, delay_margin=0),
            f"noise in the correction <= {auto.largest_noise:.3g}": replace(asked, noise=1e6),
            f"slowest mode <= {auto.largest_mode_s:.3g} s": replace(asked, slowest_s=1e3 * self.dt + asked.slowest_s),
        }
        if asked.moment_hz is not None:
            loosened[f"the moment read {asked.moment_hz:.4g} times a second"] = replace(asked, moment_hz=None)
        if asked.peak is not None:
            loosened[f"noise gain <= {auto.largest_peak:.3g}"] = replace(asked, peak=None)
        wish = (
            f"no observer of at most {self.search.order} states has {', '.join(loosened)} and attenuates; "
            f"without observer the disk margin is {self.yardstick.disk_margin_off:.3g}"
        )
        ways = []
        for name, wanted in loosened.items():
            found = self.search.quick(wanted)
            if found is not None and found.solved.value * HELPS <= 1.0:
                ways.append(f"{name} (attenuation {1.0 / found.solved.value:.3g} without it)")
        return f"{wish}; in the way: {' or '.join(ways) or 'more than one of them'}"


def _missed(m: Measured) -> str:
    return (
        "the best observer found does not keep the limits once it is certified, with disk margin "
        f"{m.disk_margin:.4g}, delay margin {m.delay_margin:.3g}, noise {m.noise:.4g}, slowest mode {m.slowest_s:.3g} s"
    )


def analysed(uncertainty: Uncertainty | None) -> Uncertainty | None:
    """The same where the observer is already made for it."""
    return replace(uncertainty, synthesis="nominal") if uncertainty else None


def best_design(block: BlockSpec, dt: float, auto: AutoSpec) -> tuple[DobBlock, Tuning]:
    """A block of one axis, designed, and how its weights were found.

    Raises UnsolvableError when there is no observer, or none that keeps the limits (naming the one in the way), and
    NotCertifiedError.
    """
    choice = _Choice(block, dt, auto)
    best, rows = choice.front()
    forms, designed, chosen = choice.designed(best)
    order = len(designed.observer.A)
    return designed, Tuning(
        name=block.name,
        auto=auto,
        asked=choice.asked,
        chosen=chosen,
        rows=rows,
        own=choice.own(),
        disk_margin_off=choice.yardstick.disk_margin_off,
        disturbance=forms.disturbance,
        noise=(forms.noise,),
        gamma_backoff=BACKOFF,
        order=order,
        limited_by=tuple(f"the {name}" for name in best.solved.binding),
        form=f"{order} states; W_d of order {len(forms.disturbance.poles)}, W_n constant",
        limit=choice.limit(choice.asked),
    )

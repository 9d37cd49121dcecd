"""The best of a family of weights (`_family.py`): the search that the optimum took the place of, to compare with."""

from dataclasses import replace
from typing import Any

import numpy as np

from bench._family import POLISH_STEPS, Family, Search, tightened
from dob_companion.artifact import DobBlock
from dob_companion.errors import NotCertifiedError, UnsolvableError
from dob_companion.synthesis.design import design_block, synthesize
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.models import to_state_space
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.plant.solvability import require_solvable
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import BlockSpec, Model, Weight, Zpk
from dob_companion.synthesis.tune.limits import Limits
from dob_companion.synthesis.tune.yardstick import Measured, Yardstick

SLACKS = (1.002, 1.02, 1.1)
"""The search keeps clear of the limits by the first factor; by more when the certificate still says otherwise."""


def searched_design(block: BlockSpec, dt: float, auto: AutoSpec) -> DobBlock:
    """A block designed with the best weights of the family.

    Raises UnsolvableError when there is no observer, or none that keeps the limits (the message says what could be
    had), and NotCertifiedError.
    """
    lag, leads = _weights(block, dt, auto)
    disturbance = Weight(f"{block.where}: weights: disturbance", Model(lag, block.where))
    own = tuple((i, Model(form, block.where)) for i, form in enumerate(leads))
    noise = Weight(f"{block.where}: weights: noise", None, own)
    return design_block(replace(block, disturbance=disturbance, noise=noise), dt)


def _weights(block: BlockSpec, dt: float, auto: AutoSpec) -> tuple[Zpk, tuple[Zpk, ...]]:
    size, backoff = len(block.axes), block.gamma_backoff
    plant = minimal(to_state_space(block.plant, dt, (size, size)))
    controller = minimal(to_state_space(block.controller, dt, (size, size)))
    delays = (block.delay_samples,) * size
    family = Family(plant, delays, auto)
    require_solvable(Problem(plant, controller, *family.systems(family.knobs(2, family.middle)), delays), block.axes)
    search = Search(family, Yardstick(plant, controller, delays, auto), backoff)
    asked = Limits.of(auto)

    def certified(W_d: Any, W_n: Any) -> Measured:
        proved = synthesize(plant, controller, W_d, W_n, delay_samples=delays, gamma_backoff=backoff, axes=block.axes)
        found, proof = search.yardstick.measure(proved.observer), proved.certificate
        if found is None:
            raise NotCertifiedError("the certified observer is unstable by the yardstick")
        return replace(
            found,
            disk_margin=proof.disk_margin,
            slowest_s=proof.slowest_mode_s,
            delay_margin=float(np.clip(found.delay_margin, proof.delay_margin_samples, proof.delay_margin_samples + 1)),
        )

    search.grid()
    search.rows(asked)  # before the choice, which gains from all that was tried for them
    for slack in SLACKS:
        best = search.best(tightened(asked, slack), POLISH_STEPS)
        if best is None:
            break
        W_d, W_n = family.forms(best.knobs, best.gamma)
        if asked.excess(certified(family.system([W_d] * size), family.system(W_n))) == 0.0:
            return W_d, W_n
    raise UnsolvableError(search.refusal(asked))

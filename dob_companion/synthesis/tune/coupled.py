"""The best of a family of weights (`search.py`), for any number of axes: what `bench` compares the optimum with."""

from dataclasses import replace
from typing import Any

import numpy as np

from dob_companion.artifact import DobBlock
from dob_companion.errors import NotCertifiedError, UnsolvableError
from dob_companion.synthesis.design import design_block, synthesize
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.models import to_state_space, weight_to_state_space
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.plant.solvability import require_solvable
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import BlockSpec, Model, Weight
from dob_companion.synthesis.tune.limits import Limits, Tuning
from dob_companion.synthesis.tune.search import POLISH_STEPS, Family, Knobs, Search
from dob_companion.synthesis.tune.yardstick import Measured, Yardstick

SLACKS = (1.002, 1.02, 1.1)
"""The search keeps clear of the limits by the first factor; by more when the certificate still says otherwise."""


def searched_design(block: BlockSpec, dt: float, auto: AutoSpec) -> tuple[DobBlock, Tuning]:
    """A block designed with the best weights of the family, and how they were found.

    Raises UnsolvableError when there is no observer, or none that keeps the limits (the message says what could be
    had), and NotCertifiedError.
    """
    tuning = _tune(block, dt, auto)
    disturbance = Weight(f"{block.where}: weights: disturbance", Model(tuning.disturbance, block.where))
    own = tuple((i, Model(form, block.where)) for i, form in enumerate(tuning.noise))
    noise = Weight(f"{block.where}: weights: noise", None, own)
    return design_block(replace(block, disturbance=disturbance, noise=noise), dt), tuning


def _tune(block: BlockSpec, dt: float, auto: AutoSpec) -> Tuning:
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
    rows = search.rows(asked)  # before the choice, which gains from all that was tried for them
    for slack in SLACKS:
        best = search.best(asked.tightened(slack), POLISH_STEPS)
        if best is None:
            raise UnsolvableError(search.refusal(asked))
        W_d, W_n = family.forms(best.knobs, best.gamma)
        chosen = certified(family.system([W_d] * size), family.system(W_n))
        if asked.excess(chosen) == 0.0:
            break
    else:
        raise UnsolvableError(search.refusal(asked))
    own = None
    if block.disturbance is not None and block.noise is not None:
        weights = (weight_to_state_space(weight, dt, size) for weight in (block.disturbance, block.noise))
        own = certified(*weights)
    return Tuning(
        name=block.name,
        auto=auto,
        asked=asked,
        chosen=chosen,
        rows=rows,
        tried=tuple(candidate.measured for candidate in search.pool),
        own=own,
        disk_margin_off=search.yardstick.disk_margin_off,
        disturbance=W_d,
        noise=W_n,
        gamma_backoff=backoff,
        order=block.largest_order,
        limited_by=asked.binding(chosen),
        form=_words(best.knobs),
    )


def _words(knobs: Knobs) -> str:
    lags = f"W_d {knobs.lags} lag{'s' * (knobs.lags > 1)} at {knobs.disturbance_hz:.3g} Hz"
    return f"{lags}, crossing at {knobs.crossing_hz:.3g} Hz, W_n from {knobs.noise_hz:.3g} Hz"

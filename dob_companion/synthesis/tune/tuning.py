"""Weights for people who do not think in weights: from what a pilot knows (`spec.auto.AutoSpec`).

For one axis the best observer itself is found, among those that a stated uncertainty leaves stable, and its weights
follow (`best.py`); coupled axes share one programme and full-block weights (`together.py`).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from dob_companion.artifact import DobBlock, DobDesign
from dob_companion.errors import DobError, SpecError, placed
from dob_companion.observer.missing import WEATHER, Weather, missing_in
from dob_companion.synthesis.design import assembled, with_attenuation
from dob_companion.synthesis.numeric import numbers_judged
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.model_file import Reader
from dob_companion.synthesis.spec.parse import BlockSpec, parse_spec
from dob_companion.synthesis.tune.best import best_design
from dob_companion.synthesis.tune.limits import Tuning
from dob_companion.synthesis.tune.together import coupled_design


@dataclass(frozen=True, slots=True)
class Task:
    """One block of a spec, and what is asked of it."""

    block: BlockSpec
    dt: float
    auto: AutoSpec


class Each(Protocol):
    """As `map`."""

    def __call__(  # noqa: D102
        self, function: Callable[[Task], tuple[DobBlock, "Tuning"]], tasks: Iterable[Task], /
    ) -> Iterable[tuple[DobBlock, "Tuning"]]: ...


def tuned_design_from_toml(
    text: str,
    source: str = "spec.toml",
    created: str = "",
    read: Reader | None = None,
    progress: Callable[[str], None] = lambda _: None,
    *,
    each: Each = map,
) -> tuple[DobDesign, tuple[Tuning, ...]]:
    """From a spec with an [auto] table to a certified design and how each block was tuned; `progress` hears of blocks.

    `read` fetches the model files that the spec names. `each` is how a function is applied to all blocks, in their
    order: as `map` does, or by several processes.

    Raises SpecError, UnsolvableError (also when the limits cannot be kept, with the numbers) or NotCertifiedError.
    """
    spec = parse_spec(text, source, read)
    tasks = [Task(block, spec.dt, block.auto) for block in spec.blocks if block.auto]
    if len(tasks) < len(spec.blocks):
        raise SpecError(
            f"{source}: key 'auto' is missing: --auto finds weights for what an [auto] table asks: "
            "disturbance_band_hz (or _corner_hz), noise_rms and least_disk_margin; without --auto the weights in the "
            "spec are used"
        )
    names = [block.name for block in spec.blocks]
    blocks, tunings = [], []
    progress(f"{', '.join(names)}: finding weights")
    for block, tuning in each(designed_and_tuned, tasks):
        blocks.append(block)
        tunings.append(tuning)
        progress(f"{len(blocks)} of {len(tasks)} designed")
    return assembled(spec, tuple(blocks), created), tuple(tunings)


def designed_and_tuned(task: Task) -> tuple[DobBlock, Tuning]:
    """One block, with the weights that were found for it.

    Raises UnsolvableError when there is no observer, or none that keeps the limits (the message says what could be
    had), and NotCertifiedError.
    """
    block = task.block
    alone = len(block.axes) == 1
    try:
        with numbers_judged():
            designed, tuning = (best_design if alone else coupled_design)(block, task.dt, task.auto)
            return with_attenuation(_in_its_weather(designed, task), task.dt, task.auto), tuning
    except DobError as problem:
        raise placed(problem, block.where) from problem


def _in_its_weather(block: DobBlock, task: Task) -> DobBlock:
    """What may be missing is judged by the weather that the spec states, where it says how strong that is: a third of
    the largest disturbance is its rms, and a band counts as a low-pass at its middle."""
    if task.block.largest_disturbance is None:
        return block
    auto = task.auto
    corner = auto.corner_hz or float(np.sqrt(auto.low_hz * auto.high_hz))
    weather = Weather(task.block.largest_disturbance / 3.0, corner, auto.noise_rms)
    bound = missing_in(block.problem, block.observer, block.delay_samples, task.dt, weather)
    found = {"missing_samples": bound.samples, "missing_moments": bound.moments, WEATHER: weather._asdict()}
    extra = {**block.certificate.extra, **found}
    return replace(block, certificate=replace(block.certificate, extra=extra))

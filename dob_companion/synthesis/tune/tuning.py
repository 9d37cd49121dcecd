"""Weights for people who do not think in weights: found by search from what a pilot knows (`spec.auto.AutoSpec`).

W_d is a first-order lag, used once or twice on every moment; W_n, on every rate, a first-order lead over white noise::

    W_d = ((z + 0.9) / (z - a))^lags               a = exp(-2 pi disturbance_hz dt)
    W_n = level (z - b) / z                        b = exp(-2 pi noise_hz dt)
    level so that ||W_d G|| = |W_n| at crossing_hz, row by row: below it the observer believes in disturbance

W_d tells the H-infinity problem where disturbances live. The second lag is what pays: it makes d -> attitude fall by
40 dB a decade towards low frequencies, where the disturbances are. Only the ratio of the weights matters for the
observer; both are scaled so that gamma is 1 and they can be read as the bounds that they become.

Search: a grid over (lags, disturbance_hz, crossing_hz, noise_hz), each point the central observer at the back-off of
its own gamma* by the Riccati equation alone; then from the best point seen by linear models of attenuation and limits
(COBYLA: M. J. D. Powell, "A direct search optimization method that models the objective and constraint functions by
linear interpolation", 1994), once for every row of the trade-off. Deterministic. The chosen weights are then solved and
certified like any.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from dob_companion.artifact import DobBlock, DobDesign
from dob_companion.errors import DobError, NotCertifiedError, SpecError, UnsolvableError, placed
from dob_companion.observer.missing import WEATHER, Weather, missing_in
from dob_companion.synthesis.design import assembled, design_block, synthesize
from dob_companion.synthesis.numeric import numbers_judged
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.models import to_state_space, weight_to_state_space
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.plant.solvability import require_solvable
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.model_file import Reader
from dob_companion.synthesis.spec.parse import BlockSpec, Model, Weight, Zpk, parse_spec
from dob_companion.synthesis.tune.search import POLISH_STEPS, Family, Knobs, Limits, Row, Search
from dob_companion.synthesis.tune.yardstick import Measured, Yardstick

SLACKS = (1.002, 1.02, 1.1)
"""The search keeps clear of the limits by the first factor; by more when the certificate still says otherwise."""


@dataclass(frozen=True, slots=True)
class Task:
    """One block of a spec with [auto]."""

    block: BlockSpec
    dt: float
    gamma_backoff: float
    auto: AutoSpec


class Each(Protocol):
    """As `map`."""

    def __call__(  # noqa: D102
        self, function: Callable[[Task], tuple[DobBlock, "Tuning"]], tasks: Iterable[Task], /
    ) -> Iterable[tuple[DobBlock, "Tuning"]]: ...


@dataclass(frozen=True, slots=True)
class Tuning:
    """How the weights of one block were chosen.

    asked, chosen     the limits of [auto], and what the weights found for them measure, solved and certified
    rows              the trade-off: other limits and what they would give, by rising disk margin
    tried             everything that the search measured
    own               the spec's own weights by the same yardstick, when it has any
    disk_margin_off   of the loop without observer
    disturbance, noise   the chosen weights, noise one for each axis
    """

    name: str
    auto: AutoSpec
    asked: Limits
    knobs: Knobs
    chosen: Measured
    rows: tuple[Row, ...]
    tried: tuple[Measured, ...]
    own: Measured | None
    disk_margin_off: float
    disturbance: Zpk
    noise: tuple[Zpk, ...]

    @property
    def limited_by(self) -> tuple[str, ...]:
        """The limits that bind, in words."""
        shares = {
            "the disk margin": self.asked.disk_margin / self.chosen.disk_margin,
            "the noise in the correction": self.chosen.noise / self.asked.noise,
            "the slowest mode": self.chosen.slowest_s / self.asked.slowest_s,
            "the delay margin": self.asked.delay_margin / self.chosen.delay_margin,
        }
        return tuple(name for name, share in shares.items() if share > 0.98)


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
    if spec.auto is None:
        raise SpecError(
            f"{source}: key 'auto' is missing: --auto searches weights for what an [auto] table asks: "
            "disturbance_band_hz, noise_rms and least_disk_margin; without --auto the weights in the spec are used"
        )
    tasks = [Task(block, spec.dt, spec.gamma_backoff, spec.auto) for block in spec.blocks]
    names = [block.name for block in spec.blocks]
    blocks, tunings = [], []
    progress(f"{', '.join(names)}: searching weights")
    for block, tuning in each(designed_and_tuned, tasks):
        blocks.append(block)
        tunings.append(tuning)
        progress(f"{len(blocks)} of {len(tasks)} designed")
    return assembled(spec, tuple(blocks), created), tuple(tunings)


def designed_and_tuned(task: Task) -> tuple[DobBlock, Tuning]:
    """One block, with the weights that were found for it. Raises as `tune_block` and `design_block` do."""
    tuning = tune_block(task.block, task.dt, task.gamma_backoff, task.auto)
    block = design_block(_with_weights(task.block, tuning), task.dt, task.gamma_backoff)
    return _in_its_weather(block, task), tuning


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


def _with_weights(block: BlockSpec, tuning: Tuning) -> BlockSpec:
    """A block with the chosen weights in place of its own."""
    disturbance = Weight(f"{block.where}: weights: disturbance", Model(tuning.disturbance, block.where))
    own = tuple((i, Model(form, block.where)) for i, form in enumerate(tuning.noise))
    noise = Weight(f"{block.where}: weights: noise", None, own)
    return replace(block, disturbance=disturbance, noise=noise)


def tune_block(block: BlockSpec, dt: float, gamma_backoff: float, auto: AutoSpec) -> Tuning:
    """The weights of one block.

    Raises UnsolvableError when there is no observer, or none that keeps the limits (the message says what could be
    had), and NotCertifiedError.
    """
    try:
        with numbers_judged():
            return _tune(block, dt, gamma_backoff, auto)
    except DobError as problem:
        raise placed(problem, block.where) from problem


def _tune(block: BlockSpec, dt: float, gamma_backoff: float, auto: AutoSpec) -> Tuning:
    size = len(block.axes)
    plant = minimal(to_state_space(block.plant, dt, (size, size)))
    controller = minimal(to_state_space(block.controller, dt, (size, size)))
    delays = (block.delay_samples,) * size
    family = Family(plant, delays, auto)
    require_solvable(Problem(plant, controller, *family.systems(family.knobs(2, family.middle)), delays), block.axes)
    search = Search(family, Yardstick(plant, controller, delays, auto), gamma_backoff)
    asked = Limits(auto.least_disk_margin, auto.largest_noise, auto.largest_mode_s, auto.least_delay_margin)

    def certified(W_d: Any, W_n: Any) -> Measured:
        proved = synthesize(
            plant, controller, W_d, W_n, delay_samples=delays, gamma_backoff=gamma_backoff, axes=block.axes
        )
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
        knobs=best.knobs,
        chosen=chosen,
        rows=rows,
        tried=tuple(candidate.measured for candidate in search.pool),
        own=own,
        disk_margin_off=search.yardstick.disk_margin_off,
        disturbance=W_d,
        noise=W_n,
    )

"""A few plants that stand for a whole uncertainty: the model, each end of each interval, and the worst one found.

They are what a design is flown with in simulation before it flies: proofs say more of the linear loop, but a flight has
the switching, the limits and the supervisor in it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from dob_companion.artifact import DobBlock, StateSpaceData
from dob_companion.synthesis.norms.hinf import angle_grid
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import from_data, to_data
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.robust.analysis import GRID
from dob_companion.synthesis.robust.cells import Sample, factor_system
from dob_companion.synthesis.robust.destabilize import destabilized
from dob_companion.synthesis.robust.interconnection import interconnect
from dob_companion.synthesis.spec.uncertainty import ChannelUncertainty, Uncertainty, parse_uncertainty
from dob_companion.toml import Table

NOMINAL, WORST = "nominal", "worst"


@dataclass(frozen=True, slots=True)
class Relative:
    """One plant of a block's family: its name, the plant, and in words what was changed about each axis."""

    name: str
    plant: StateSpaceData
    changed: tuple[str, ...]


def family(block: DobBlock, dt: float) -> list[Relative]:
    """The model first. Nothing but the model where the certificate records no uncertainty.

    Every axis of the block is moved at once. The worst is the one that `robust_worst` records; under a multiplicative
    bound a w(z) of full size, aimed at the frequency where the loop is weakest, is on top of it.
    """
    found = [Relative(NOMINAL, block.problem.plant, ("as designed for",) * len(block.axes))]
    recorded = block.certificate.extra
    if "robust_uncertainty" not in recorded:
        return found
    uncertainty = parse_uncertainty(Table("robust_uncertainty", recorded["robust_uncertainty"]), block.axes)
    plant = from_data(block.problem.plant, dt)
    for name, sample in _ends(uncertainty):
        true = plant * factor_system(uncertainty, sample, dt)
        found.append(Relative(name, to_data(true), _words(uncertainty, sample)))
    worst = _recorded(uncertainty, recorded.get("robust_worst"))
    factor = factor_system(uncertainty, worst, dt)
    moved = destabilized(_grid(block, dt), uncertainty, factor)
    words = _words(uncertainty, worst)
    for k, each in enumerate(moved or [factor]):
        more = tuple(f"{w}, at the bound over frequency" if moved else w for w in words)
        found.append(Relative(WORST if k == 0 else f"{WORST} {k + 1}", to_data(plant * each), more))
    return found


def _ends(uncertainty: Uncertainty) -> Iterator[tuple[str, Sample]]:
    """Each kind of parameter at its lower and at its upper end in all axes, everything else as in the model.

    An end that is the model's own value is no other plant.
    """
    kinds = [dict(_spans(channel)) for channel in uncertainty.channels]
    for name in ("gain", "pole", "modes"):
        spans = [kind[name] for kind in kinds]
        parts = [c.intervals[i] for c, span in zip(uncertainty.channels, spans, strict=True) for i in span]
        for end in ("low", "high"):
            if any(getattr(part, end) != part.nominal for part in parts):
                values = tuple(
                    tuple(getattr(p, end) if i in span else p.nominal for i, p in enumerate(c.intervals))
                    for c, span in zip(uncertainty.channels, spans, strict=True)
                )
                yield f"{name} {end}", Sample(values, (0,) * len(spans))
    if any(c.most_delay for c in uncertainty.channels):
        nominal = tuple(tuple(p.nominal for p in c.intervals) for c in uncertainty.channels)
        yield "delay", Sample(nominal, tuple(c.most_delay for c in uncertainty.channels))


def _spans(channel: ChannelUncertainty) -> Iterator[tuple[str, range]]:
    """Where each kind of parameter stands among the channel's intervals."""
    poles = 1 + len(channel.poles)
    yield from (("gain", range(1)), ("pole", range(1, poles)), ("modes", range(poles, len(channel.intervals))))


def _recorded(uncertainty: Uncertainty, rows: Any) -> Sample:
    """The worst plant as a certificate keeps it: per input its real parameters, then its delay."""
    return Sample(
        tuple(
            tuple(float(v) for v in row[: len(c.intervals)]) for row, c in zip(rows, uncertainty.channels, strict=True)
        ),
        tuple(int(row[-1]) for row in rows),
    )


def _words(uncertainty: Uncertainty, sample: Sample) -> tuple[str, ...]:
    said = []
    for channel, values, late in zip(uncertainty.channels, sample.values, sample.delays, strict=True):
        names = ["gain ×", *["pole "] * len(channel.poles), *["mode ", "damping "] * len(channel.modes)]
        moved = [
            f"{name}{value:.4g}{' Hz' if name == 'mode ' else ''}"
            for name, value, part in zip(names, values, channel.intervals, strict=True)
            if value != part.nominal
        ]
        moved += [f"{late} more sample{'s' if late > 1 else ''} of delay"] if late else []
        said.append(", ".join(moved) or "as designed for")
    return tuple(said)


def _grid(block: DobBlock, dt: float) -> Any:
    asked = block.problem
    problem = Problem(
        plant=from_data(asked.plant, dt),
        controller=from_data(asked.controller, dt),
        disturbance_weight=from_data(asked.disturbance_weight, dt),
        noise_weight=from_data(asked.noise_weight, dt),
        delays=(block.delay_samples,) * len(block.axes),
    )
    observer = from_data(block.observer, dt)
    loop = close_loop(problem.plant, problem.controller, observer, problem.delays)
    return interconnect(problem, observer, np.asarray(angle_grid(loop.system.A, GRID)))

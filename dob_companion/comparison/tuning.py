"""The rule by which every method is tuned, and the search that follows it.

The rule: of all settings of a method, take the one whose RMS attitude error is expected to be least, provided that

1. the loop is stable, and the disk margin is no smaller than with the H-infinity design,
2. gyro noise alone moves the correction no more, in RMS, than with the H-infinity design.

So all methods pay the same price, and what is compared is what they buy with it. The attitude error is the measure of
the comparison itself: the others are tuned to it, the H-infinity design (tuned by its weights) is not.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dob_companion.comparison.flight import expect
from dob_companion.comparison.measure import LoopResponses
from dob_companion.comparison.rational import NotApplicableError
from dob_companion.comparison.vehicle import Vehicle, close

SLACK = 1.001
"""The price may be exceeded by a thousandth: the bounds themselves are measured numbers."""

FINEST = 0.01
"""The search ends when neighbouring settings differ by no more than this share."""


@dataclass(frozen=True, slots=True)
class Knob:
    """One setting, searched on a logarithmic scale from `low` to `high`, at first at `points` places."""

    name: str
    unit: str
    low: float
    high: float
    points: int


@dataclass(frozen=True, slots=True)
class Family:
    """All settings of one form of a method: `build` makes the observer of one value for each knob."""

    form: str
    knobs: tuple[Knob, ...]
    build: Callable[..., Any]


@dataclass(frozen=True, slots=True, eq=False)
class Tuned:
    """The best observer of a family, its settings, and the attitude error (rad, RMS) expected of it."""

    observer: Any
    settings: str
    attitude: float


@dataclass(frozen=True, slots=True, eq=False)
class Judge:
    """The rule, for one vehicle in one weather (sigma of the disturbance, normalized torque)."""

    vehicle: Vehicle
    scale: float
    responses: LoopResponses
    least_disk_margin: float
    most_noise: float

    @classmethod
    def by(cls, vehicle: Vehicle, scale: float, reference: Any) -> "Judge":
        """The rule that an observer sets for the others; raises ValueError when its own loop is unstable."""
        measured = expect(close(vehicle, reference), scale)
        if measured is None:
            raise ValueError("the reference design's loop is unstable")
        responses = LoopResponses(vehicle)
        return cls(vehicle, scale, responses, responses.disk_margin(reference), measured.noise_in_correction)

    def attitude(self, observer: Any, beat: float = np.inf) -> float:
        """Expected RMS attitude error; infinite when the rule is broken or it would not be below `beat`."""
        measured = expect(close(self.vehicle, observer), self.scale)
        if measured is None or measured.attitude >= beat or measured.noise_in_correction > SLACK * self.most_noise:
            return np.inf
        return measured.attitude if SLACK * self.responses.disk_margin(observer) >= self.least_disk_margin else np.inf


def tune(families: Sequence[Family], judge: Judge) -> Tuned | None:
    """The best setting of the best family; None when no setting keeps the rule.

    Each family is searched over a grid that then closes in on its best point. Raises NotApplicableError when no
    family has a form for this plant.
    """
    found, reasons = [], []
    for family in families:
        try:
            best = _tune(family, judge)
        except NotApplicableError as reason:
            reasons.append(reason)
            continue
        if best is not None:
            found.append(best)
    if len(reasons) == len(families):
        raise reasons[0]
    return min(found, key=lambda tuned: tuned.attitude, default=None)


def _tune(family: Family, judge: Judge) -> Tuned | None:
    spans = [(np.log(k.low), np.log(k.high), k.points) for k in family.knobs]
    best, least, where = None, np.inf, np.zeros(len(spans))
    steps = np.full(len(spans), np.inf)
    while np.max(steps) > FINEST:
        steps = np.array([(high - low) / (points - 1) for low, high, points in spans])
        axes = [np.linspace(*span) for span in spans]
        for point in np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes)):
            observer = family.build(*np.exp(point))
            attitude = judge.attitude(observer, least)
            if attitude < least:
                best, least, where = observer, attitude, point
        if best is None:
            return None
        count = 9 if len(spans) == 1 else 5
        limits = [(np.log(k.low), np.log(k.high)) for k in family.knobs]
        spans = [
            (max(x - step, low), min(x + step, high), count)
            for x, step, (low, high) in zip(where, steps, limits, strict=True)
        ]
    named = zip(family.knobs, np.exp(where), strict=True)
    words = [f"{knob.name} {value:.3g} {knob.unit}".strip() for knob, value in named]
    return Tuned(best, ", ".join([family.form, *words] if family.form else words), least)

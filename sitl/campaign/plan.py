"""What a campaign flies: its values, and the numbered flights that they make."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

DRAWS = 3
"""Distinguishes this generator from the others of the same seed."""


class Between(NamedTuple):
    """A number drawn for each seed, uniformly from `low` to `high`."""

    low: float
    high: float


Values = tuple[float, ...] | Between
"""Flown one after the other, or drawn."""


class Inputs(NamedTuple):
    """All that tells one flight of a campaign from the others.

    `delay` in samples, 0 without a link; `gain` and `pole` are factors on the plant's gain and on the corner frequency
    of its lag; `wind_m_s` is the mean wind's speed, None for the scenario's own wind.
    """

    flight: int
    seed: int
    airframe: str
    design: str
    delay: int
    gain: float
    pole: float
    wind_m_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """A checked campaign. `designs` maps names to the text of each design.json.

    Every seed is flown with every combination of airframe, design, delay, gain, pole and wind (the scenario's own when
    `wind_m_s` is empty); what is `Between` is drawn once a seed, the same for all its flights, so that designs and
    delays are compared on equal terms.
    """

    scenario: str
    designs: Mapping[str, str]
    seeds: int
    first_seed: int
    airframes: tuple[str, ...]
    delays: tuple[int, ...]
    gain: Values
    pole: Values
    wind_m_s: Values
    parameters: Mapping[str, float]

    def flights(self) -> list[Inputs]:
        """All flights, numbered from 0, seed by seed."""
        flights: list[Inputs] = []
        for seed in range(self.first_seed, self.first_seed + self.seeds):
            rng = np.random.default_rng([seed, DRAWS])
            gains, poles, winds = (_of_seed(values, rng) for values in (self.gain, self.pole, self.wind_m_s))
            for choice in product(self.airframes, self.designs, self.delays, gains, poles, winds or (None,)):
                flights.append(Inputs(len(flights), seed, *choice))
        return flights


def _of_seed(values: Values, rng: np.random.Generator) -> tuple[float, ...]:
    """What one seed flies. A number is drawn in any case, so that one range does not shift the next one's draws."""
    share = rng.random()
    return (values.low + share * (values.high - values.low),) if isinstance(values, Between) else values

"""What a tuning must keep, what was found for it, and how it is told."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dob_companion.synthesis.optimal.asked import wanted_of
from dob_companion.synthesis.optimal.problem import Wanted
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import Matrices, Zpk
from dob_companion.synthesis.tune.yardstick import Measured

Array = NDArray[np.float64]

BINDS = 0.98
"""Share of a limit from which on it counts as one that binds."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a choice must keep."""

    disk_margin: float
    noise: float
    slowest_s: float
    delay_margin: float

    @classmethod
    def of(cls, auto: AutoSpec) -> "Limits":
        """Those of [auto]."""
        return cls(auto.least_disk_margin, auto.largest_noise, auto.largest_mode_s, auto.least_delay_margin)

    def wanted(self, auto: AutoSpec, slack: float) -> Wanted:
        """As the programmes take them, beside what else `auto` asks, kept clear of by the factor `slack`."""
        return replace(
            wanted_of(auto, slack),
            disk_margin=self.disk_margin * slack,
            noise=self.noise / slack,
            slowest_s=self.slowest_s / slack,
        )

    def room(self, m: Measured) -> Array:
        """Logarithmic distance (4,) to each limit, negative where it is broken."""
        shares = (
            m.disk_margin / self.disk_margin,
            self.noise / m.noise,
            self.slowest_s / m.slowest_s,
            m.delay_margin / self.delay_margin if self.delay_margin else 1.0,
        )
        return np.asarray(np.log(np.maximum(shares, 1e-12)))

    def excess(self, m: Measured) -> float:
        """By how much the limits are broken; 0 when kept."""
        return float(-np.sum(np.minimum(self.room(m), 0.0)))

    def binding(self, m: Measured) -> tuple[str, ...]:
        """The limits that something found comes close to, in words."""
        shares = {
            "the disk margin": self.disk_margin / m.disk_margin,
            "the noise in the correction": m.noise / self.noise,
            "the slowest mode": m.slowest_s / self.slowest_s,
            "the delay margin": self.delay_margin / m.delay_margin,
        }
        return tuple(name for name, share in shares.items() if share > BINDS)


@dataclass(frozen=True, slots=True)
class Row:
    """One row of the trade-off: what was asked, the best that was found for it, and `limit`, an attenuation that no
    observer of any order exceeds within those limits; None where none is known."""

    asked: Limits
    found: Measured
    limit: float | None = None


@dataclass(frozen=True, slots=True)
class Tuning:
    """How the weights of one block were chosen.

    asked, chosen     the limits of [auto], and what the weights found for them measure, solved and certified
    rows              the trade-off: other limits and what they would give, by rising disk margin
    own               the spec's own weights by the same yardstick, when it has any
    disk_margin_off   of the loop without observer
    disturbance, noise   the chosen weights, noise one for each axis
    gamma_backoff, order   with which they are solved: within that of gamma*, at most so many states (None: any number)
    limited_by        the limits that bind, in words
    form              the weights in words
    limit             of the attenuation of any observer within the limits asked; None where none is known
    """

    name: str
    auto: AutoSpec
    asked: Limits
    chosen: Measured
    rows: tuple[Row, ...]
    own: Measured | None
    disk_margin_off: float
    disturbance: Zpk | Matrices
    noise: tuple[Zpk, ...]
    gamma_backoff: float
    order: int | None
    limited_by: tuple[str, ...]
    form: str
    limit: float | None = None

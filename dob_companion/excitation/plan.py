"""What is to be done, axis by axis, and what has been done."""

from dataclasses import dataclass, field

from dob_companion.artifact import AXES
from dob_companion.excitation.limits import Limits
from dob_companion.excitation.signal import Excitation, Floats, table

AMPLITUDES = {"roll": 0.06, "pitch": 0.06, "yaw": 0.12}
"""Peaks of the moment, normalized torque, where none is stated. A fifth of what an observer may correct with
(DOB_LIMIT), and for yaw, which multirotors turn with the drag of their propellers, twice as much."""


@dataclass(frozen=True, slots=True)
class AxisPlan:
    """One axis: its name, the signal's peak, normalized torque, and its values, one a sample."""

    name: str
    amplitude: float
    values: tuple[float, ...] = field(repr=False)

    @property
    def index(self) -> int:
        """0 roll, 1 pitch, 2 yaw."""
        return AXES.index(self.name)

    def at(self, samples: float) -> float:
        """The signal so many samples after its begin, on the line between two values; its last one from its end on."""
        whole = int(samples)
        if whole >= len(self.values) - 1:
            return self.values[-1]
        before, after = self.values[whole], self.values[whole + 1]
        return before + (samples - whole) * (after - before)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The axes in their order, one after another, within limits; `dt` in s."""

    dt: float
    signal: Excitation
    limits: Limits
    axes: tuple[AxisPlan, ...]

    @classmethod
    def of(cls, signal: Excitation, amplitudes: dict[str, float], limits: Limits, dt: float) -> "Plan":
        """Draw the signals. `amplitudes`: by axis, in the order in which they are excited.

        Raises InputError for a signal that cannot be made.
        """
        signal.check(dt)

        def drawn(name: str, amplitude: float) -> Floats:
            return table(signal, amplitude, dt, AXES.index(name))

        axes = (AxisPlan(name, peak, tuple(drawn(name, peak).tolist())) for name, peak in amplitudes.items())
        return cls(dt=dt, signal=signal, limits=limits, axes=tuple(axes))


@dataclass(slots=True)
class Passage:
    """One axis as it was excited: stamps of the vehicle's clock, µs, and the share of the amplitude that was reached.

    `end_us` is None until the moment is zero again.
    """

    axis: str
    amplitude: float
    begin_us: int
    end_us: int | None = None
    level: float | None = None
    complete: bool = False

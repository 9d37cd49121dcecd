"""How far the true plant may be from its model: intervals of gain, poles, modes and delay, or a bound over frequency.

Every uncertainty is a factor phi_i(z) at plant input i, so the true plant is G diag(phi_1 … phi_m)::

    phi(z) = g  prod (z - p0) / (z - p)  prod |z - s0|^2 / |z - s|^2  z^-k  (1 + w(z))
             gain    poles                  modes                     delay  |w| <= multiplicative

A moved pole or mode keeps the model's gain over monic factors, that is, what the plant does far above it. Every
interval holds the model itself, so that the sets scaled by k grow with k from the model (k = 0) through what was
stated (k = 1).
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

from dob_companion.errors import SpecError
from dob_companion.synthesis.spec.limits import LONGEST_DELAY, MOST_DELAY_CASES
from dob_companion.toml import Table, shown

CHANNEL_KEYS = ("gain", "pole", "modes", "delay_samples", "frequency_hz", "multiplicative")
SYNTHESES = ("robust", "nominal")


@dataclass(frozen=True, slots=True)
class Interval:
    """low <= nominal <= high."""

    nominal: float
    low: float
    high: float

    def scaled(self, k: float) -> "Interval":
        """The interval k times as wide to either side of nominal."""
        return Interval(self.nominal, *(self.nominal + k * (end - self.nominal) for end in (self.low, self.high)))


@dataclass(frozen=True, slots=True)
class Mode:
    """A lightly damped pole pair: natural frequency in Hz and damping ratio, 0 < damping < 1."""

    frequency_hz: Interval
    damping: Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelUncertainty:
    """One plant input. `gain` is relative to the model (nominal 1), `poles` are real and discrete, `most_delay`
    counts samples beyond the model's, `multiplicative` is the largest |w| at `frequency_hz`, linear in between and
    constant beyond.
    """

    gain: Interval = Interval(1.0, 1.0, 1.0)
    poles: tuple[Interval, ...] = ()
    modes: tuple[Mode, ...] = ()
    most_delay: int = 0
    frequency_hz: tuple[float, ...] = ()
    multiplicative: tuple[float, ...] = ()

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """All real parameters in one order: gain, poles, then frequency and damping of each mode."""
        modes = tuple(part for mode in self.modes for part in (mode.frequency_hz, mode.damping))
        return (self.gain, *self.poles, *modes)

    def scaled(self, k: float) -> "ChannelUncertainty | None":
        """k times as uncertain; None where that is no plant of this kind (no gain, or an unstable factor)."""
        gain, poles = self.gain.scaled(k), tuple(pole.scaled(k) for pole in self.poles)
        modes = tuple(Mode(mode.frequency_hz.scaled(k), mode.damping.scaled(k)) for mode in self.modes)
        sound = gain.low > 0.0 and all(pole.low > -1.0 and pole.high < 1.0 for pole in poles)
        sound &= all(m.frequency_hz.low > 0.0 and m.damping.low > 0.0 and m.damping.high < 1.0 for m in modes)
        if not sound:
            return None
        delay, bound = math.floor(k * self.most_delay + 1e-9), tuple(k * value for value in self.multiplicative)
        return ChannelUncertainty(
            gain=gain, poles=poles, modes=modes, most_delay=delay, frequency_hz=self.frequency_hz, multiplicative=bound
        )


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """One `ChannelUncertainty` per plant input, independent of each other; `synthesis` is one of SYNTHESES."""

    channels: tuple[ChannelUncertainty, ...]
    synthesis: str = "robust"

    def scaled(self, k: float) -> "Uncertainty | None":
        """k times as uncertain, or None where some channel has no such set."""
        channels = tuple(channel.scaled(k) for channel in self.channels)
        whole = tuple(channel for channel in channels if channel is not None)
        return Uncertainty(whole, self.synthesis) if len(whole) == len(channels) else None

    def to_object(self, axes: tuple[str, ...]) -> dict[str, object]:
        """As `parse_uncertainty` reads it, each axis spelled out; plain numbers, lists and words."""
        return {"synthesis": self.synthesis} | {
            axis: dict(_written(channel)) for axis, channel in zip(axes, self.channels, strict=True)
        }


def parse_uncertainty(table: Table, axes: tuple[str, ...]) -> Uncertainty:
    """Read `[block.uncertainty]`: keys for every axis alike, or a table of its own for an axis.

    Raises SpecError, one line that names the key and what was expected.
    """
    table.expect(("synthesis", *CHANNEL_KEYS, *axes))
    bare = table.without((*axes, "synthesis"))
    common = _channel(bare) if len(bare) else None
    channels = []
    for axis in axes:
        if axis in table:
            channels.append(_channel(table.table(axis, CHANNEL_KEYS)))
        elif common is not None:
            channels.append(common)
        else:
            channels.append(ChannelUncertainty())
    uncertainty = Uncertainty(tuple(channels), table.choice("synthesis", SYNTHESES, "robust"))
    cases = math.prod(channel.most_delay + 1 for channel in channels)
    if cases > MOST_DELAY_CASES:
        raise SpecError(
            f"{table.where}: delay_samples: {cases} combinations of all axes, expected at most {MOST_DELAY_CASES}"
        )
    if all(channel == ChannelUncertainty() for channel in channels):
        raise SpecError(f"{table.where}: nothing is uncertain: expected some of {', '.join(CHANNEL_KEYS)}")
    return uncertainty


def _channel(table: Table) -> ChannelUncertainty:
    gain = Interval(1.0, 1.0, 1.0)
    if "gain" in table:
        gain = _around(table, "gain", 1.0)
        if gain.low <= 0.0:
            raise SpecError(f"{table.where}: gain: expected a range above 0, got {list(table.numbers('gain'))}")
    frequency, bound = _bound(table)
    return ChannelUncertainty(
        gain=gain,
        poles=tuple(_poles(table)),
        modes=tuple(_modes(table)),
        most_delay=_delay(table),
        frequency_hz=frequency,
        multiplicative=bound,
    )


def _around(table: Table, key: str, nominal: float) -> Interval:
    ends = table.numbers(key)
    if len(ends) != 2 or not ends[0] <= nominal <= ends[1]:
        raise SpecError(f"{table.where}: {key}: expected [low, high] around {nominal:g}, got {shown(list(ends))}")
    return Interval(nominal, *ends)


def _poles(table: Table) -> Iterator[Interval]:
    if "pole" not in table:
        return
    given = table.get("pole")
    for item in given if isinstance(given, list) else [given]:
        one = Table(f"{table.where}: pole", item, ("nominal", "range"))
        pole = _around(one, "range", one.number("nominal"))
        if not -1.0 < pole.low <= pole.high < 1.0:
            raise SpecError(
                f"{one.where}: range: [{pole.low:g}, {pole.high:g}], expected inside (-1, 1): a pole at or beyond the "
                "unit circle must be known"
            )
        yield pole


def _modes(table: Table) -> Iterator[Mode]:
    if "modes" not in table:
        return
    for item in table.tables("modes"):
        one = Table(f"{table.where}: modes", item, ("frequency_hz", "damping", "range_hz", "damping_range"))
        hertz = one.number("frequency_hz", lambda x: x > 0.0, "a positive number of Hz")
        damping = one.number("damping", lambda x: 0.0 < x < 1.0, "a ratio between 0 and 1")
        mode = Mode(
            _around(one, "range_hz", hertz) if "range_hz" in one else Interval(hertz, hertz, hertz),
            _around(one, "damping_range", damping) if "damping_range" in one else Interval(damping, damping, damping),
        )
        if mode.frequency_hz.low <= 0.0 or not 0.0 < mode.damping.low <= mode.damping.high < 1.0:
            raise SpecError(f"{one.where}: expected frequencies above 0 and damping ratios between 0 and 1")
        yield mode


def _delay(table: Table) -> int:
    if "delay_samples" not in table:
        return 0
    ends = table.items("delay_samples")
    whole = all(isinstance(end, int) and not isinstance(end, bool) for end in ends)
    if not whole or len(ends) != 2 or ends[0] != 0 or not 0 <= ends[1] <= LONGEST_DELAY:
        raise SpecError(
            f"{table.where}: delay_samples: expected [0, most] in whole samples beyond the model's, at most "
            f"{LONGEST_DELAY} (a delay that is always there belongs in the plant), got {shown(ends)}"
        )
    return int(ends[1])


def _bound(table: Table) -> tuple[tuple[float, ...], tuple[float, ...]]:
    if "multiplicative" not in table and "frequency_hz" not in table:
        return (), ()
    frequency, bound = table.numbers("frequency_hz"), table.numbers("multiplicative")
    if not frequency or len(frequency) != len(bound):
        raise SpecError(
            f"{table.where}: multiplicative: {len(bound)} values, expected one for each of the "
            f"{len(frequency)} of frequency_hz"
        )
    if any(b <= a for a, b in itertools.pairwise(frequency)) or frequency[0] < 0.0:
        raise SpecError(f"{table.where}: frequency_hz: expected rising frequencies of 0 Hz or more")
    if min(bound) < 0.0:
        raise SpecError(f"{table.where}: multiplicative: expected values of 0 or more, got {min(bound):g}")
    return frequency, bound


def _written(channel: ChannelUncertainty) -> Iterator[tuple[str, object]]:
    yield "gain", [channel.gain.low, channel.gain.high]
    yield "pole", [{"nominal": pole.nominal, "range": [pole.low, pole.high]} for pole in channel.poles]
    yield (
        "modes",
        [
            {
                "frequency_hz": mode.frequency_hz.nominal,
                "damping": mode.damping.nominal,
                "range_hz": [mode.frequency_hz.low, mode.frequency_hz.high],
                "damping_range": [mode.damping.low, mode.damping.high],
            }
            for mode in channel.modes
        ],
    )
    yield "delay_samples", [0, channel.most_delay]
    if channel.multiplicative:
        yield "frequency_hz", list(channel.frequency_hz)
        yield "multiplicative", list(channel.multiplicative)

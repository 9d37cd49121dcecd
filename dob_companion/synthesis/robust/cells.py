"""A set of uncertain plants as cells, each covered by a disk at every frequency.

The factor phi_i (`uncertainty.py`) over a box of its parameters lies in a disk of the complex plane, found by
circular arithmetic (Gargantini and Henrici, Numerische Mathematik 18, 1971), which rounds outwards by
construction: a product of disks is covered by (c1 c2, |c1| r2 + |c2| r1 + r1 r2), and 1 / (c, r) is exactly the
disk (conj(c), r) / (|c|^2 - r^2). Halving a box halves its disks, so the cover becomes as tight as one likes.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.synthesis.plant.estimation import delay
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.spec.uncertainty import ChannelUncertainty, Interval, Mode, Uncertainty

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Disk = tuple[ComplexArray, Array]
"""Centres and radii over frequency."""


@dataclass(frozen=True, slots=True)
class Cell:
    """A box of plants: for each input, an interval per real parameter (in ChannelUncertainty's order) and a delay."""

    uncertainty: Uncertainty
    delays: tuple[int, ...]

    def halves(self, channel: int, parameter: int) -> tuple["Cell", "Cell"]:
        """Cut one parameter in two."""
        part = self.uncertainty.channels[channel].intervals[parameter]
        middle = (part.low + part.high) / 2.0
        low, high = Interval(part.nominal, part.low, middle), Interval(part.nominal, middle, part.high)
        return self._with(channel, parameter, low), self._with(channel, parameter, high)

    def _with(self, channel: int, parameter: int, part: Interval) -> "Cell":
        channels = list(self.uncertainty.channels)
        channels[channel] = _replaced(channels[channel], parameter, part)
        return Cell(Uncertainty(tuple(channels), self.uncertainty.synthesis), self.delays)


@dataclass(frozen=True, slots=True)
class Sample:
    """One plant of the set: per input, the value of every real parameter, and a delay."""

    values: tuple[tuple[float, ...], ...]
    delays: tuple[int, ...]


def first_cells(uncertainty: Uncertainty) -> list[Cell]:
    """One cell for each combination of delays."""
    ranges = [range(channel.most_delay + 1) for channel in uncertainty.channels]
    return [Cell(uncertainty, delays) for delays in itertools.product(*ranges)]


def disks(cell: Cell, angles: Array, dt: float) -> tuple[ComplexArray, Array, list[tuple[int, int, Array]]]:
    """Centres (N, m), radii (N, m), and (channel, parameter, share of the radius over frequency) of what can be cut."""
    z, centres, radii, shares = np.exp(1j * angles), [], [], []
    for i, (channel, late) in enumerate(zip(cell.uncertainty.channels, cell.delays, strict=True)):
        disk = (z**-late, np.zeros(len(z)))
        for first, factor, widths in _factors(channel, z, dt):
            disk = _product(disk, factor)
            shares += [(i, first + k, width) for k, width in enumerate(widths) if np.any(width > 0.0)]
        if channel.multiplicative:
            hertz = angles / (2.0 * np.pi * dt)
            disk = _product(disk, (np.ones_like(z), np.interp(hertz, channel.frequency_hz, channel.multiplicative)))
        centres.append(disk[0])
        radii.append(disk[1])
    return np.stack(centres, axis=1), np.stack(radii, axis=1), shares


def samples(uncertainty: Uncertainty, interior: int, seed: int, most_vertices: int = 64) -> list[Sample]:
    """The model, the vertices (a seeded choice of them when there are more than `most_vertices`), and random plants."""
    rng = np.random.default_rng(seed)
    spans = [part for channel in uncertainty.channels for part in channel.intervals]
    cut = [channel.most_delay for channel in uncertainty.channels]
    ends = [(p.low, p.high) if p.high > p.low else (p.nominal,) for p in spans] + [(0, d) if d else (0,) for d in cut]
    count = int(np.prod([len(end) for end in ends], dtype=float))
    if count <= most_vertices:
        corners = list(itertools.product(*ends))
    else:
        corners = [tuple(end[int(rng.integers(len(end)))] for end in ends) for _ in range(most_vertices)]
    inside = [
        (*(rng.uniform(p.low, p.high) for p in spans), *(int(rng.integers(d + 1)) for d in cut))
        for _ in range(interior)
    ]
    nominal = (*(p.nominal for p in spans), *(0 for _ in cut))
    return [_sample(uncertainty, point) for point in [nominal, *corners, *inside]]


def factor_system(uncertainty: Uncertainty, sample: Sample, dt: float) -> Any:
    """diag(phi_1 … phi_m) of one sample, a stable state-space system."""
    parts = []
    for channel, values, late in zip(uncertainty.channels, sample.values, sample.delays, strict=True):
        phi = ct.ss([], [], [], [[values[0]]], dt)
        for pole, value in zip(channel.poles, values[1:], strict=False):
            phi = _section([-pole.nominal], [-value], dt) * phi
        rest = values[1 + len(channel.poles) :]
        for k, mode in enumerate(channel.modes):
            old = mode_root(mode.frequency_hz.nominal, mode.damping.nominal, dt)
            new = mode_root(rest[2 * k], rest[2 * k + 1], dt)
            phi = _section([-2.0 * old.real, abs(old) ** 2], [-2.0 * new.real, abs(new) ** 2], dt) * phi
        parts.append(delay((late,), dt) * phi)
    return stack(parts)


def mode_root(hertz: float, damping: float, dt: float) -> complex:
    """The discrete pole (upper half-plane) of a mode."""
    return complex(np.exp(2.0 * np.pi * hertz * dt * complex(-damping, np.sqrt(1.0 - damping**2))))


def _factors(channel: ChannelUncertainty, z: ComplexArray, dt: float) -> list[tuple[int, Disk, list[Array]]]:
    """Of each factor: index of its first parameter, its disk, and what each parameter adds to its relative radius."""
    ones = np.ones(len(z))
    middle, half = _middle(channel.gain)
    found: list[tuple[int, Disk, list[Array]]] = [(0, (middle + 0j * z, half * ones), [half / middle * ones])]
    for k, pole in enumerate(channel.poles):
        middle, half = _middle(pole)
        inverse = _inverse((z - middle, half * ones))
        found.append((1 + k, _product((z - pole.nominal, 0.0 * ones), inverse), [half / np.abs(z - middle)]))
    for k, mode in enumerate(channel.modes):
        found.append((1 + len(channel.poles) + 2 * k, *_mode(mode, z, dt)))
    return found


def _mode(mode: Mode, z: ComplexArray, dt: float) -> tuple[Disk, list[Array]]:
    """|dz/d omega| <= dt and |dz/d zeta| <= dt omega / sqrt(1 - zeta^2) bound how far the root moves."""
    hertz, wide = _middle(mode.frequency_hz)
    damping, deep = _middle(mode.damping)
    moves = (
        2.0 * np.pi * dt * wide,
        2.0 * np.pi * dt * mode.frequency_hz.high * deep / np.sqrt(1 - mode.damping.high**2),
    )
    root, old = mode_root(hertz, damping, dt), mode_root(mode.frequency_hz.nominal, mode.damping.nominal, dt)
    reach = np.full(len(z), sum(moves))
    pair = _product(_inverse((z - root, reach)), _inverse((z - root.conjugate(), reach)))
    model = (z - old) * (z - old.conjugate())
    away = np.minimum(np.abs(z - root), np.abs(z - root.conjugate()))
    return _product((model, np.zeros(len(z))), pair), [move / away for move in moves]


def _middle(part: Interval) -> tuple[float, float]:
    return (part.low + part.high) / 2.0, (part.high - part.low) / 2.0


def _product(a: Disk, b: Disk) -> Disk:
    return a[0] * b[0], np.abs(a[0]) * b[1] + np.abs(b[0]) * a[1] + a[1] * b[1]


def _inverse(a: Disk) -> Disk:
    """Unbounded (radius inf) where the disk holds zero."""
    room = np.abs(a[0]) ** 2 - a[1] ** 2
    safe = np.where(room > 0.0, room, 1.0)
    radius: Array = np.where(room > 0.0, a[1] / safe, np.inf)
    return np.asarray(a[0].conj() / safe, dtype=np.complex128), radius


def _section(num: list[float], den: list[float], dt: float) -> Any:
    """(z^n + num) / (z^n + den), companion form."""
    n = len(den)
    A = np.eye(n, k=-1)
    A[0] = -np.array(den)
    return ct.ss(A, np.eye(n, 1), [np.array(num) - np.array(den)], [[1.0]], dt)


def _replaced(channel: ChannelUncertainty, parameter: int, part: Interval) -> ChannelUncertainty:
    parts = list(channel.intervals)
    parts[parameter] = part
    count = len(channel.poles)
    rest = parts[1 + count :]
    modes = tuple(Mode(rest[2 * k], rest[2 * k + 1]) for k in range(len(channel.modes)))
    delay_, hertz, bound = channel.most_delay, channel.frequency_hz, channel.multiplicative
    return ChannelUncertainty(
        gain=parts[0],
        poles=tuple(parts[1 : 1 + count]),
        modes=modes,
        most_delay=delay_,
        frequency_hz=hertz,
        multiplicative=bound,
    )


def _sample(uncertainty: Uncertainty, point: tuple[float, ...]) -> Sample:
    values, first = [], 0
    for channel in uncertainty.channels:
        last = first + len(channel.intervals)
        values.append(tuple(float(v) for v in point[first:last]))
        first = last
    return Sample(tuple(values), tuple(int(late) for late in point[first:]))

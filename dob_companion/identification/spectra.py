"""Frequency response of a plant inside a closed loop, from an instrument, what went in and what came out.

Wind and noise run through the controller into u, so S_yu / S_uu is drawn towards -1/C where they rule. An instrument r
that they do not reach (what was injected; what the pilot asked) is free of it: G = S_yr S_ur^-1, a matrix over the
axes that move together (P. Wellstead, "Non-parametric methods of system identification", Automatica 17 (1981);
L. Ljung, *System Identification*, 2nd ed. 1999, on closed loops; M. Tischler and R. Remple, *Aircraft and Rotorcraft
System Identification*, 2nd ed. AIAA 2012, on conditioning and on composite windows).

What is estimated is the ratio H of y to v, which a reference model near the plant makes of u, both differenced: windows
cut neither the slow motion nor the delay in two, and H is flat, so that averages over bands do not smear.

Long windows serve low frequencies, short ones high frequencies; where two serve, they are averaged by their variance.
The errors of all windows are counted as if they were one, for they look at the same data.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.stats import f as f_distribution

from dob_companion.identification.result import Complexes, Floats

Indices = NDArray[np.int64]
Spans = tuple[tuple[float, float], ...]

LONGEST_S, SHORTEST_S = 20.0, 1.0
FIRST_BIN = 2.5
"""A Hann window cannot tell frequencies below this many cycles a window from a drift."""
WEAK = 0.05
"""Largest relative variance of S_ur: above, an instrument is too weak and draws the estimate to the direct one."""
VAGUE = 0.35
"""Largest relative deviation: what is known worse says nothing."""
LEAST_WINDOWS = 4.5
"""So many of the longest fit in, end to end: then half over they are eight."""
BRIDGED = 2
LEFT = 2.0
"""Least averages beyond the axes that are estimated together."""
LEAST_FREEDOM = 5.0
"""Degrees of freedom of a variance: with fewer its inverse has no variance."""
NEIGHBOURS = np.array([1.0, -2.0 / 3.0, 1.0 / 6.0])
"""Correlation of white noise between bins of a Hann window, 0, 1 and 2 apart; 1/6 also between windows half over."""
COMPLEX = ("value", "direct", "loop", "rest")
CLUSTERS = 8
"""From so many windows on, the scatter between them counts as well."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """cycles: of a frequency in the windows that serve it. band: ratio of its ends, where bins are not sparse."""

    cycles: tuple[float, float]
    band: float


SMOOTH = Resolution((6.0, 24.0), 1.18)
FINE = Resolution((100.0, 200.0), 1.02)
"""So fine that a mode of 2 % damping shows."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Ratio H of an axis over n bands: fields as in `result.Response`; direct is the ratio S_yv / S_vv, loop what
    closes around an instrument that adds to u, S_rr / S_ur - 1. rest and weak: what is left of y and v without the
    instruments has the ratio `rest` (wind and noise, by the controller), and is the part `weak` of S_vr, by variance.
    """

    frequency: Floats
    value: Complexes
    deviation: Floats
    band: Floats
    coherence_u: Floats
    coherence_y: Floats
    averages: Floats
    direct: Complexes
    loop: Complexes
    rest: Complexes
    weak: Floats

    @property
    def wider(self) -> Floats:
        """By how much more variance a fit may count each band. A variance estimated from few averages is small by
        chance as often as large, and weighs too much when it is: of weights 1/s² with nu degrees of freedom a mean
        scatters by (nu - 2) / (nu - 4) more than of the true ones, and believes in (nu - 2) / nu of that."""
        freedom = np.maximum(2.0 * (self.averages - LEFT), LEAST_FREEDOM)
        return np.asarray(freedom / (freedom - 4.0))

    def at(self, where: NDArray[np.bool_]) -> "Estimate":
        """Some of the bands."""
        return Estimate(*(getattr(self, each.name)[where] for each in fields(self)))


@dataclass(frozen=True, slots=True)
class Layout:
    """Windows of one length (samples) over stretches: where they start in each, their middles in samples of all
    stretches; which bins of their spectra count, the hertz of these, which of all bands are there, and the first bin
    of each.
    """

    length: int
    starts: tuple[Indices, ...]
    middle: Floats
    bins: Indices
    hertz: Floats
    bands: Indices
    first: Indices

    @property
    def index(self) -> Indices:
        """For each bin which of the bands here it is in."""
        return np.asarray(np.searchsorted(self.first, np.arange(len(self.hertz)), side="right") - 1)

    def banded(self, values: Any) -> Any:
        """Sums over the bins of each band."""
        return np.add.reduceat(values, self.first, axis=0)

    def spectra(self, stretches: Sequence[Floats]) -> Complexes:
        """Of the windows of signals (n, 3), one for each stretch: (windows, bins, 3). Their means do not matter: a
        constant is in the first two bins of a Hann window only."""
        window = np.hanning(self.length + 1)[:-1]
        out = np.empty((len(self.middle), len(self.bins), 3), complex)
        for channel in range(3):
            done = 0
            for signal, starts in zip(stretches, self.starts, strict=True):
                whole = np.ascontiguousarray(signal[:, channel])
                if len(starts):
                    cut = np.lib.stride_tricks.sliding_window_view(whole, self.length)[starts] * window
                    out[done : done + len(starts), :, channel] = rfft(cut, axis=1)[:, self.bins]
                done += len(starts)
        return out


@dataclass(frozen=True, slots=True)
class Level:
    """Spectra (windows, bins, 3) of all windows of one length: output and reference output (differenced), input and
    instrument."""

    layout: Layout
    middle: Floats
    Y: Complexes
    V: Complexes
    U: Complexes
    R: Complexes

    def banded(self, values: Any) -> Any:
        """As `Layout.banded`."""
        return self.layout.banded(values)

    def kept(self, spans: Spans | None) -> "Level | None":
        """The windows that lie wholly in one of the spans, samples of all stretches."""
        if spans is None:
            return self
        half = self.layout.length / 2
        inside = np.any([(self.middle - half >= a - 1) & (self.middle + half <= b + 1) for a, b in spans], axis=0)
        if not inside.any():
            return None
        Y, V, U, R = (each[inside] for each in (self.Y, self.V, self.U, self.R))
        return Level(self.layout, self.middle[inside], Y, V, U, R)


def layouts(
    sizes: Sequence[int], dt: float, highest_hz: float, resolution: Resolution = SMOOTH
) -> tuple[list[Layout], Floats]:
    """Of all window lengths over stretches of these sizes, samples; and the edges of the bands, Hz, to `highest_hz`."""
    longest = min(LONGEST_S, max(sizes) * dt / 3.0, sum(sizes) * dt / LEAST_WINDOWS)
    lengths = [longest]
    while lengths[-1] / 2.0 >= SHORTEST_S:
        lengths.append(lengths[-1] / 2.0)
    edges = _edges(lengths, highest_hz, resolution)
    found = [_layout(sizes, length, edges, dt, lengths, resolution) for length in lengths]
    return [layout for layout in found if layout is not None], edges


def _edges(lengths: list[float], highest: float, resolution: Resolution) -> Floats:
    edges = [FIRST_BIN / lengths[0]]
    while edges[-1] < highest:
        window = min(max(resolution.cycles[1] / edges[-1], lengths[-1]), lengths[0])
        edges.append(max(resolution.band * edges[-1], edges[-1] + 2.0 / window))
    return np.array(edges)


def _layout(
    sizes: Sequence[int], length: float, edges: Floats, dt: float, lengths: list[float], resolution: Resolution
) -> Layout | None:
    size = next_fast_len(round(length / dt), real=True)
    hertz: Floats = np.asarray(np.fft.rfftfreq(size, dt), float)
    band = np.searchsorted(edges, hertz, side="right") - 1
    low = edges[0] if length == lengths[0] else resolution.cycles[0] / length
    high = edges[-1] if length == lengths[-1] else resolution.cycles[1] / length
    bins = np.flatnonzero((band >= 0) & (band < len(edges) - 1) & (edges[band] >= low) & (hertz < high))
    starts = tuple(np.arange(0, one - size + 1, size // 2) for one in sizes)
    offsets = np.cumsum([0, *sizes[:-1]])
    middle = np.concatenate([offset + each + size / 2 for offset, each in zip(offsets, starts, strict=True)])
    if not len(middle) or not len(bins):
        return None
    bands, first = np.unique(band[bins], return_index=True)
    return Layout(size, starts, middle, bins, hertz[bins], bands, first)


def estimate(
    found: Sequence[Level], edges: Floats, axis: int, spans: Spans | None = None, *, gaps: bool = False
) -> Estimate:
    """H of an axis; `spans` as in `Level.kept`. With `gaps` also bands that stand alone or are vague."""
    weight = np.zeros(len(edges) - 1)
    sums = [np.zeros(len(weight), complex) for _ in fields(Estimate)]
    for level in found:
        kept = level.kept(spans)
        if kept is None:
            continue
        bands, one = _of_level(kept, axis, np.inf if gaps else VAGUE)
        own = one.averages  # and not by deviations: these are the smaller, the nearer chance draws to `rest`
        weight[bands] += own
        for total, each in zip(sums, fields(Estimate), strict=True):
            total[bands] += own * getattr(one, each.name)
    got = weight > 0.0 if gaps else _longest_run(weight > 0.0)
    means = {each.name: total[got] / weight[got] for total, each in zip(sums, fields(Estimate), strict=True)}
    numbers: dict[str, Any] = {name: mean if name in COMPLEX else mean.real for name, mean in means.items()}
    return Estimate(**numbers)


def _longest_run(good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The longest run of good bands without its ends: there, more often than elsewhere, a band is good by luck.
    Up to BRIDGED bands between two good ones do not end a run: a multisine has no lines there."""
    at = np.flatnonzero(good)
    if not len(at):
        return good
    runs = np.split(at, np.flatnonzero(np.diff(at) > BRIDGED + 1) + 1)
    longest = max(runs, key=len)
    kept = np.zeros(len(good), bool)
    kept[longest[int(longest[0] > 0) : -1]] = True
    return kept


def _of_level(level: Level, axis: int, vague: float) -> tuple[Indices, Estimate]:
    """Bands where the instrument is strong enough, and the estimate there."""
    Y, V, R, index = level.Y[:, :, axis], level.V, level.R, level.layout.index
    counts = np.diff(np.append(level.layout.first, len(level.layout.hertz)))
    crowd = 1.0 + 2.0 * NEIGHBOURS[1] ** 2 * (counts - 1) / counts + 2.0 * NEIGHBOURS[2] ** 2 * (counts > 2)
    averages = len(Y) * counts / crowd / (1.0 + 2.0 * NEIGHBOURS[2] ** 2)
    S_vr = level.banded(np.einsum("wbk,wbj->bkj", V, R.conj()))
    S_yr = level.banded(np.einsum("wb,wbj->bj", Y, R.conj()))
    coherence_u = _coherence(level, level.U, R)
    many = np.maximum(averages, 1.5)[:, None]
    sure = (coherence_u - 1.0 / many) / (1.0 - 1.0 / many)  # what few averages show by chance
    strong = (1.0 - sure < WEAK * sure * many) & (many >= LEFT + 3.0)
    _leave_out(S_vr, S_yr, strong, axis)
    inverse = _inverse(S_vr)
    H = np.einsum("bj,bjk->bk", S_yr, inverse)
    instrument = np.einsum("wbj,bj->wb", R.conj(), inverse[index, :, axis])  # the sum of y times it is H of the axis
    left = averages - np.count_nonzero(H, axis=1)
    error = Y - np.einsum("bk,wbk->wb", H[index], V)
    S_ee = level.banded(_power(error)) / (len(Y) * counts) * averages / np.maximum(left, 0.5)
    variance = np.maximum(S_ee * level.banded(_noise_through(instrument, index)), _scatter(level, error * instrument))
    own, deviation = V[:, :, axis], np.sqrt(variance)
    weight = np.sum(np.abs(own * instrument), axis=0)
    left_of_own = own - np.einsum("bk,wbk->wb", _ratio(level, own, strong, axis)[index], R)
    S_oo = np.maximum(level.banded(_power(left_of_own)), 1e-300)
    S_eo = level.banded(np.sum(error * left_of_own.conj(), axis=0))
    direct = level.banded(np.sum(Y * own.conj(), axis=0)) / np.maximum(level.banded(_power(own)), 1e-300)
    estimate = Estimate(
        frequency=2.0 * np.pi * level.banded(weight * level.layout.hertz) / np.maximum(level.banded(weight), 1e-300),
        value=H[:, axis],
        deviation=deviation,
        band=deviation * np.sqrt(f_distribution.ppf(0.95, 2.0, 2.0 * np.maximum(left, 1.0))),
        coherence_u=coherence_u[:, axis],
        coherence_y=_coherence(level, Y, R[:, :, axis]),
        averages=averages,
        direct=direct,
        loop=_loop(level, axis),
        rest=H[:, axis] + S_eo / S_oo,
        weak=variance * S_oo / np.maximum(level.banded(_power(error)), 1e-300),
    )
    good = strong[:, axis] & (left >= LEFT) & (deviation > 0.0) & (deviation < vague * np.abs(H[:, axis]))
    return level.layout.bands[good], estimate.at(good)


def _ratio(level: Level, x: Complexes, strong: NDArray[np.bool_], axis: int) -> Complexes:
    """Of a signal (windows, bins) to the instruments that count, (bands, 3)."""
    R = level.R
    S_rr = level.banded(np.einsum("wbk,wbj->bkj", R, R.conj()))
    S_xr = level.banded(np.einsum("wb,wbj->bj", x, R.conj()))
    _leave_out(S_rr, S_xr, strong, axis)
    return np.asarray(np.einsum("bj,bjk->bk", S_xr, _inverse(S_rr)))


def _inverse(S: Complexes) -> Complexes:
    """Instruments that are one have no inverse, and nothing is said by them (`checks.moved_alike`)."""
    return np.asarray(np.linalg.inv(S) if np.all(np.linalg.cond(S) < 1e12) else np.linalg.pinv(S))


def _leave_out(S_vr: Complexes, S_yr: Complexes, strong: NDArray[np.bool_], axis: int) -> None:
    """Other axes do not count where their instruments say nothing of their input; nor does anything where the own
    one says nothing."""
    for other in {0, 1, 2} - {axis}:
        weak = ~(strong[:, other] & strong[:, axis])
        S_vr[weak, other, :] = S_vr[weak, :, other] = S_yr[weak, other] = 0.0
        S_vr[weak, other, other] = 1.0
    S_vr[~strong[:, axis], axis, axis] = 1.0


def _noise_through(instrument: Complexes, index: Indices) -> Floats:
    """Variance of the sum of white noise times the instrument, over that of the noise, bin by bin of all windows."""
    total = _power(instrument)
    for apart in (1, 2):
        pair = np.sum((instrument[:, apart:] * instrument[:, :-apart].conj()).real, axis=0)
        total[apart:] += 2.0 * NEIGHBOURS[apart] * pair * (index[apart:] == index[:-apart])
    return total


def _scatter(level: Level, shares: Complexes) -> Floats:
    """Variance of H by what each window adds to its error, neighbours being correlated; 0 of a few windows."""
    if len(shares) < CLUSTERS:
        return np.zeros(len(level.layout.bands))
    each = np.add.reduceat(shares, level.layout.first, axis=1)
    alone, pairs = _power(each), 2.0 * np.sum((each[1:] * each[:-1].conj()).real, axis=0)
    return np.asarray(np.maximum(alone, alone + pairs))


def _loop(level: Level, axis: int) -> Complexes:
    R, U = level.R[:, :, axis], level.U[:, :, axis]
    cross = level.banded(np.sum(U * R.conj(), axis=0))
    return np.asarray(level.banded(_power(R)) / np.where(np.abs(cross) > 0.0, cross, 1e-300) - 1.0)


def _coherence(level: Level, x: Complexes, r: Complexes) -> Floats:
    cross = level.banded(np.sum(x * r.conj(), axis=0))
    return np.asarray(np.abs(cross) ** 2 / np.maximum(level.banded(_power(x)) * level.banded(_power(r)), 1e-300))


def _power(x: Complexes) -> Floats:
    return np.asarray(np.sum(np.abs(x) ** 2, axis=0))

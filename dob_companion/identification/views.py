"""Spectra of a grid by an instrument, and what it shows of an axis by a reference (see `spectra`)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dob_companion.autopilots.transfer import Transfer
from dob_companion.identification.fit import DELAY, LAG, LEAD, MODES, POLE
from dob_companion.identification.grid import Grid
from dob_companion.identification.held import held_filter
from dob_companion.identification.result import Complexes, Floats
from dob_companion.identification.segments import Instrument
from dob_companion.identification.spectra import SMOOTH, Estimate, Layout, Level, Resolution, layouts

Stretches = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Seen:
    """What an instrument shows of an axis, by a reference."""

    instrument: Instrument
    spans: Stretches
    levels: list[Level]
    edges: Floats
    estimate: Estimate
    reference: Floats


class Views:
    """Spectra of a grid, each counted once: axes that were excited together share them."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self._kept: dict[tuple[object, ...], tuple[list[Layout], Floats, list[Complexes]]] = {}

    def levels(
        self,
        instrument: Instrument,
        spans: Stretches,
        reference: Floats,
        known_part: Transfer,
        resolution: Resolution = SMOOTH,
    ) -> tuple[list[Level], Floats]:
        """All windows in the spans, and the edges of the bands."""
        grid = self._grid
        all_layouts, edges, Y = self._of("y", spans, resolution, lambda a, b: np.diff(grid.rates[a:b], axis=0))
        U = self._of("u", spans, resolution, lambda a, b: grid.moment[a : b - 1])[2]
        R = self._of(instrument.name, spans, resolution, lambda a, b: instrument.values[a : b - 1])[2]
        whole, late = reference_of(reference, known_part), float(reference[DELAY])

        def answer(a: int, b: int) -> Floats:
            return np.diff(held_filter(whole.num, whole.den, late, grid.dt, grid.moment[a:b]), axis=0)

        V = self._of((*whole.num, *whole.den, late), spans, resolution, answer)[2]
        return [Level(one, one.middle, *each) for one, *each in zip(all_layouts, Y, V, U, R, strict=True)], edges

    def _of(
        self, name: object, spans: Stretches, resolution: Resolution, signal: Callable[[int, int], Floats]
    ) -> tuple[list[Layout], Floats, list[Complexes]]:
        key = (name, spans, resolution)
        if key not in self._kept:
            sizes = [b - a - 1 for a, b in spans]
            all_layouts, edges = layouts(sizes, self._grid.dt, self._grid.highest_hz, resolution)
            signals = [signal(a, b) for a, b in spans]
            self._kept[key] = all_layouts, edges, [one.spectra(signals) for one in all_layouts]
        return self._kept[key]


def reference_of(p: Floats, known_part: Transfer) -> Transfer:
    """Of unit gain, all but the delay."""
    lag, lead = float(p[LAG]), float(p[LEAD])
    whole = Transfer((1.0,), (1.0, float(p[POLE]))) * Transfer((1.0,), (lag, 1.0) if lag else (1.0,)) * known_part
    if lead and lag:  # without a lag it would not be proper
        whole *= Transfer((lead, 1.0), (1.0,))
    for peak, damping, dip, damping_dip in p[MODES:].reshape(-1, 4).tolist():
        dips = Transfer((1.0 / dip**2, 2.0 * damping_dip / dip, 1.0), (1.0,))
        whole *= dips * Transfer((1.0,), (1.0 / peak**2, 2.0 * damping / peak, 1.0))
    return whole

"""From a record to a model of each axis, or to the reason why there is none.

For each axis: the best instrument that is strong enough, the response by it, checks that this is the aircraft, a model,
its intervals and its bound. In two passes: the first model is the reference of the second estimate (see `spectra`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dob_companion.artifact import AXES
from dob_companion.autopilots.transfer import Transfer
from dob_companion.identification import checks, verdict
from dob_companion.identification.bound import Peaks, bound
from dob_companion.identification.fit import (
    DELAY,
    LAG,
    LEAD,
    MODES,
    POLE,
    Data,
    Fit,
    Spread,
    best_start,
    fit,
    fit_structures,
    spread,
)
from dob_companion.identification.grid import Flags, Grid, gridded
from dob_companion.identification.held import held_filter, held_response
from dob_companion.identification.known import Known, known
from dob_companion.identification.record import Record
from dob_companion.identification.result import (
    AxisModel,
    AxisResult,
    Bound,
    Complexes,
    Floats,
    Identification,
    Interval,
    Mode,
    Response,
)
from dob_companion.identification.segments import USED, Instrument, excited, instruments, segments, states, stretches
from dob_companion.identification.spectra import (
    FINE,
    SMOOTH,
    Estimate,
    Layout,
    Level,
    Resolution,
    Spans,
    estimate,
    layouts,
)

FIRST_REFERENCE = np.array([0.03, 0.03, 0.01, 0.0])
"""Slow pole, lag, delay and lead that the first pass takes for near enough."""
LEAST_POLE = 0.02
"""Of a reference: a pure integrator of the moment's mean would run away."""
PARTS = 6
"""Every third of so many parts in time is held out."""
SEGMENTS = 4
"""Parts in time whose gains are compared."""
DIFFERENT = 2.6
"""χ² per degree of freedom from which these gains differ by more than noise: 95 % of three."""


def identify(record: Record, *, axes: Sequence[str] = AXES, rate_hz: float = 250.0, modes: int = 0) -> Identification:
    """All of `axes`, for a design at `rate_hz`; `modes`: flexible modes to look for on each axis.

    Never raises for what a record holds: an axis of which nothing can be said has the reason in `why`.
    """
    whole = Identification(
        axes={},
        rate_hz=rate_hz,
        source=record.source,
        segments=(),
        remarks=record.remarks,
        parameters=record.parameters,
    )
    why = verdict.unfit(record, rate_hz)
    if why:
        return replace(whole, axes=_refused(axes, why))
    grid = gridded(record, rate_hz)
    state = states(record, grid)
    remarks = [*record.remarks, grid.gyro_timing.said("gyro"), grid.moment_timing.said("moment")]
    if grid.rate_hz != rate_hz:
        remarks.append(f"identified at the record's own {grid.rate_hz:g} Hz")
    if record.armed is None:
        remarks.append("the record does not tell whether it is armed: taken as armed")
    if record.flying is None and record.thrust is None:
        remarks.append("the record does not tell whether it flies: taken as flying")
    why = verdict.not_flown(state, grid)
    if why:
        found = segments(grid, state, {})
        return replace(whole, axes=_refused(axes, why), segments=found, remarks=tuple(remarks))
    results, used, views = {}, {}, _Views(grid)
    for axis in axes:
        said = known(record, axis)
        remarks += [f"{axis}: {line}" for line in said.remarks]
        results[axis], used[axis] = _Axis(views, grid, state == USED, axis, said, modes).result()
    return replace(whole, axes=results, segments=segments(grid, state, used), remarks=tuple(dict.fromkeys(remarks)))


def _refused(axes: Sequence[str], why: str) -> dict[str, AxisResult]:
    return {axis: AxisResult(axis=axis, usable=False, why=why) for axis in axes}


Stretches = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class _Seen:
    """What an instrument shows of an axis, by a reference."""

    instrument: Instrument
    spans: Stretches
    levels: list[Level]
    edges: Floats
    estimate: Estimate
    reference: Floats


class _Views:
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
        whole, late = _reference(reference, known_part), float(reference[DELAY])

        def answer(a: int, b: int) -> Floats:
            return np.diff(held_filter(whole.num, whole.den, late, grid.dt, grid.moment[a:b]), axis=0)

        V = self._of((*whole.num, *whole.den, late), spans, resolution, answer)[2]
        return [Level(one, one.middle, *each) for one, *each in zip(all_layouts, Y, V, U, R, strict=True)], edges

    def _of(
        self, name: object, spans: Stretches, resolution: Resolution, signal: Callable[[int, int], Floats]
    ) -> tuple[list[Layout], Floats, list[Complexes]]:
        key = (name, spans, resolution)
        if key not in self._kept:
            all_layouts, edges = layouts([b - a - 1 for a, b in spans], self._grid.dt, resolution)
            signals = [signal(a, b) for a, b in spans]
            self._kept[key] = all_layouts, edges, [one.spectra(signals) for one in all_layouts]
        return self._kept[key]


class _Axis:
    """One axis of a grid."""

    def __init__(self, views: _Views, grid: Grid, usable: Flags, axis: str, said: Known, modes: int) -> None:
        self._views, self._grid, self._usable, self._modes = views, grid, usable, modes
        self._name, self._known = axis, said
        self._axis = AXES.index(axis)

    def result(self) -> tuple[AxisResult, Stretches]:
        """The axis' result, and the stretches that it rests on."""
        best: _Seen | None = None
        doubts = []
        for instrument in instruments(self._grid):
            dt = self._grid.dt
            spans = tuple(stretches(excited(instrument, self._axis, self._usable, dt), dt))
            if not spans:
                continue
            seen = self._seen(instrument, spans, FIRST_REFERENCE)
            doubt = self._doubt(seen)
            if doubt:
                doubts.append((doubt, seen))
                continue
            best = seen
            break
        if best is None:
            why, seen_best = self._best_doubt(doubts)
            response = self._response(seen_best) if seen_best and len(seen_best.estimate.frequency) else None
            return AxisResult(axis=self._name, usable=False, why=why, response=response), ()
        return self._judged(best), best.spans

    def _best_doubt(self, doubts: list[tuple[str, _Seen]]) -> tuple[str, _Seen | None]:
        """Of all instruments, the doubt of that which showed most."""
        if not doubts:
            return f"no excitation: {verdict.DOUBLETS}", None
        return max(doubts, key=lambda each: len(each[1].estimate.frequency))

    def _seen(self, instrument: Instrument, spans: Stretches, reference: Floats) -> _Seen:
        found, edges = self._views.levels(instrument, spans, reference, self._known.in_record)
        return _Seen(instrument, spans, found, edges, estimate(found, edges, self._axis), reference)

    def _doubt(self, seen: _Seen) -> str:
        """Why this instrument shows nothing of the aircraft; "" where it does."""
        if other := checks.other_axis(seen.levels, self._axis):
            return f"axes swapped: {other}"
        if len(seen.estimate.frequency) < verdict.BANDS:
            return f"too little excitation by the {seen.instrument.name}: {verdict.DOUBLETS}"
        w = seen.estimate.frequency
        if checks.is_controller(w, seen.estimate.value * self._at(seen.reference, w), self._known.controllers):
            return f"this shows the controller (-1/C), not the aircraft: {verdict.DOUBLETS}"
        r, y = seen.instrument.values[:, self._axis], self._grid.rates[:, self._axis]
        if checks.follows_output([(np.diff(y[a:b]), r[a : b - 1]) for a, b in seen.spans], self._grid.dt):
            return f"the {seen.instrument.name} follows the aircraft and does not move it: {verdict.DOUBLETS}"
        return ""

    def _judged(self, first: _Seen) -> AxisResult:
        data = self._data(first.estimate, first.reference)
        start = fit(data, (POLE, LAG, DELAY), best_start(data))
        reference = start.parameters.copy()
        reference[POLE] = max(reference[POLE], LEAST_POLE)
        seen = self._seen(first.instrument, first.spans, reference)
        response = self._response(seen)
        if len(response.frequency) < verdict.BANDS:
            why = f"too little excitation by the {seen.instrument.name}: {verdict.DOUBLETS}"
            return AxisResult(axis=self._name, usable=False, why=why, response=response)
        found, edges = self._views.levels(seen.instrument, seen.spans, reference, self._known.in_record, FINE)
        fine = estimate(found, edges, self._axis, gaps=True)
        resolved = fine if self._modes and len(fine.frequency) > len(seen.estimate.frequency) else seen.estimate
        data = self._data(resolved, reference)
        chosen, richest, reason = fit_structures(data, self._modes, start.parameters)
        width = spread(richest)
        between, gains = self._between(seen, chosen)
        peaks = Peaks(self._data(fine, reference), fine.averages)
        limit = bound(chosen, richest, width, resolved.averages, between, peaks)
        model = self._model(seen, chosen, width, limit, between, reason)
        why = (
            verdict.not_one_aircraft(model, between, gains)
            or verdict.not_covered(response, self._crossover(chosen))
            or verdict.not_known(model)
            or self._known.doubt
        )
        return AxisResult(
            axis=self._name,
            usable=not why,
            why=why or verdict.praise(model, response),
            response=response,
            model=model,
        )

    def _data(self, found: Estimate, reference: Floats) -> Data:
        factor = self._at(reference, found.frequency)
        return Data(
            found.frequency,
            found.value * factor,
            found.deviation * np.abs(factor),
            self._known.in_record,
            self._grid.dt,
        )

    def _at(self, reference: Floats, frequency: Floats) -> np.ndarray:
        whole = _reference(reference, self._known.in_record)
        return held_response(whole.num, whole.den, float(reference[DELAY]), self._grid.dt, frequency)

    def _response(self, seen: _Seen) -> Response:
        found = seen.estimate
        factor = self._at(seen.reference, found.frequency)
        inverse = None
        if self._known.controllers:
            inverse = -1.0 / self._known.controllers[-1].response(found.frequency)
        moved = np.any([np.any(seen.instrument.values[a:b], axis=0) for a, b in seen.spans], axis=0)
        others = tuple(axis for k, axis in enumerate(AXES) if k != self._axis and moved[k])
        return Response(
            frequency=found.frequency,
            value=found.value * factor,
            deviation=found.deviation * np.abs(factor),
            band=found.band * np.abs(factor),
            coherence_u=found.coherence_u,
            coherence_y=found.coherence_y,
            averages=found.averages,
            direct=found.direct * factor,
            rate_hz=self._grid.rate_hz,
            instrument=seen.instrument.name,
            axes=(self._name, *others),
            inverse_controller=inverse,
        )

    def _part(self, seen: _Seen, spans: Spans) -> Data | None:
        part = estimate(seen.levels, seen.edges, self._axis, spans)
        return self._data(part, seen.reference) if len(part.frequency) >= verdict.BANDS else None

    def _between(self, seen: _Seen, chosen: Fit) -> tuple[float, Floats]:
        """Relative standard deviation of the gain between parts in time beyond noise, and these gains."""
        total = sum(b - a - 1 for a, b in seen.spans)
        ends = np.linspace(0.0, total, SEGMENTS + 1)
        gains, variances = [], []
        for span in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
            part = self._part(seen, (span,))
            if part is None:
                continue
            gain = part.gain(chosen.parameters)
            squares = float(np.sum(part.residual(gain, chosen.parameters) ** 2)) / (2 * len(part.frequency) - 1)
            weight = float(np.sum(np.abs(part.model(chosen.parameters) / part.deviation) ** 2))
            gains.append(gain)
            variances.append(0.5 / weight * max(1.0, squares))
        if len(gains) < 2:
            return 0.0, np.array(gains)
        own = 1.0 / np.array(variances)
        mean = float(np.sum(own * gains) / np.sum(own))
        differ = float(np.sum(own * (np.array(gains) - mean) ** 2)) / (len(gains) - 1)
        if differ < DIFFERENT:
            return 0.0, np.array(gains)
        excess = float(np.var(gains, ddof=1)) - float(np.mean(variances))
        return float(np.sqrt(max(0.0, excess))) / abs(mean), np.array(gains)

    def _held_out(self, seen: _Seen, chosen: Fit) -> tuple[float, float]:
        """Misfit and χ² of windows that were left out of a fit of the same structure."""
        ends = np.linspace(0.0, sum(b - a - 1 for a, b in seen.spans), PARTS + 1).tolist()
        fitted = self._part(seen, ((ends[0], ends[2]), (ends[3], ends[5])))
        tested = self._part(seen, ((ends[2], ends[3]), (ends[5], ends[6])))
        if fitted is None or tested is None:
            return float("nan"), float("nan")
        return _misfit(fit(fitted, chosen.free, chosen.parameters), tested)

    def _crossover(self, chosen: Fit) -> float:
        """Where the rate loop's gain is 1, Hz; 0 where the gains are not known."""
        if not self._known.controllers:
            return 0.0
        w = np.geomspace(1.0, 0.9 * np.pi / self._grid.dt, 200)
        loop = chosen.response(w, self._grid.dt) * self._known.controllers[0].response(w)
        above = np.flatnonzero(np.abs(loop) >= 1.0)
        return float(w[above[-1]] / (2.0 * np.pi)) if len(above) else 0.0

    def _model(self, seen: _Seen, chosen: Fit, width: Spread, limit: Bound, between: float, reason: str) -> AxisModel:
        late, p = self._known.late_s, chosen.parameters
        gain = _interval(chosen.gain, width.gain[0], width.gain[1])
        apart = 2.0 * between * abs(chosen.gain)
        misfit, chi2 = _misfit(chosen, chosen.data)
        held_out_misfit, held_out_chi2 = self._held_out(seen, chosen)
        return AxisModel(
            acceleration_per_unit=Interval(gain.value, gain.low - apart, gain.high + apart),
            slow_pole_rad_s=_interval(p[POLE], *width.parameters[POLE]),
            lag_s=_interval(p[LAG], *width.parameters[LAG]),
            delay_s=_interval(p[DELAY] + late, *(width.parameters[DELAY] + late)),
            lead_s=_interval(p[LEAD], *width.parameters[LEAD]),
            bound=limit,
            modes=_modes(p, width),
            filters=self._known.in_link,
            about_filters=self._known.about,
            structure=chosen.words,
            why=reason,
            misfit=misfit,
            chi2=chi2,
            held_out_misfit=held_out_misfit,
            held_out_chi2=held_out_chi2,
        )


def _reference(p: Floats, known_part: Transfer) -> Transfer:
    """Of unit gain, all but the delay."""
    lag = float(p[LAG])
    return Transfer((1.0,), (1.0, float(p[POLE]))) * Transfer((1.0,), (lag, 1.0) if lag else (1.0,)) * known_part


def _misfit(model: Fit, data: Data) -> tuple[float, float]:
    """Relative root mean square, each frequency by its accuracy, and χ²."""
    off = model.gain * data.model(model.parameters) - data.value
    weight = np.abs(data.value) ** 2 / data.deviation**2
    relative = float(np.sqrt(np.sum(np.abs(off / data.value) ** 2 * weight) / np.sum(weight)))
    count = max(1, 2 * len(off) - (1 + len(model.free) if data is model.data else 0))
    return relative, float(np.sum(2.0 * np.abs(off / data.deviation) ** 2)) / count


def _interval(value: float, low: float, high: float) -> Interval:
    return Interval(float(value), float(min(value, low)), float(max(value, high)))


def _modes(p: Floats, width: Spread) -> tuple[Mode, ...]:
    found = []
    for k in range(MODES, len(p), 4):
        peak, damping, dip, damping_dip = (_interval(p[k + j], *width.parameters[k + j]) for j in range(4))
        found.append(Mode(_hertz(peak), damping, _hertz(dip), damping_dip))
    return tuple(found)


def _hertz(w: Interval) -> Interval:
    return Interval(*(x / (2.0 * np.pi) for x in (w.value, w.low, w.high)))

"""One axis of a record: from its signals to a model, or to the reason why there is none.

The best instrument that is strong enough, the response by it, checks that this is the aircraft, a model, its intervals
and its bound. In two passes: the first model is the reference of the second estimate (see `spectra`).
"""

from dataclasses import dataclass

import numpy as np

from dob_companion.artifact import AXES
from dob_companion.identification import checks, early, verdict
from dob_companion.identification.agreement import shift
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
    flexible,
    rigid,
    simplest,
    spread,
)
from dob_companion.identification.flights import Between, Flights, compared, parts
from dob_companion.identification.grid import Flags
from dob_companion.identification.held import held_response
from dob_companion.identification.known import Known
from dob_companion.identification.result import (
    AxisModel,
    AxisResult,
    Bound,
    Floats,
    Interval,
    Mode,
    Response,
)
from dob_companion.identification.segments import INJECTED, Instrument, excited, instruments, stretches
from dob_companion.identification.spectra import FINE, Estimate, Spans, estimate
from dob_companion.identification.views import Seen, Stretches, Views, reference_of

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


@dataclass(frozen=True, slots=True)
class _Doubt:
    """Why an axis cannot be used, and whether its signals are not what they are named for."""

    why: str
    mistaken: bool = False


class OneAxis:
    """One axis of a grid; `usable` says where, `modes` how many flexible ones at most."""

    def __init__(
        self, views: Views, flights: Flights, sources: list[str], usable: Flags, axis: str, said: Known, modes: int
    ) -> None:
        self._views, self._grid, self._usable, self._modes = views, flights.grid, usable, modes
        self._ends, self._sources = flights.ends, sources
        self._name, self._known = axis, said
        self._axis = AXES.index(axis)

    def result(self) -> tuple[AxisResult, Stretches]:
        """The axis' result, and the stretches that it rests on."""
        best: Seen | None = None
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
            doubt, seen_best = self._best_doubt(doubts)
            response = self._response(seen_best) if seen_best and len(seen_best.estimate.frequency) else None
            return self._refused(doubt, response), ()
        return self._judged(best), best.spans

    def _refused(self, doubt: _Doubt, response: Response | None) -> AxisResult:
        return AxisResult(axis=self._name, usable=False, why=doubt.why, response=response, mistaken=doubt.mistaken)

    def _best_doubt(self, doubts: list[tuple[_Doubt, Seen]]) -> tuple[_Doubt, Seen | None]:
        """Of all instruments, the doubt of that which showed most."""
        if not doubts:
            return _Doubt(f"no excitation: {verdict.DOUBLETS}"), None
        return max(doubts, key=lambda each: len(each[1].estimate.frequency))

    def _seen(self, instrument: Instrument, spans: Stretches, reference: Floats) -> Seen:
        found, edges = self._views.levels(instrument, spans, reference, self._known.in_record)
        return Seen(instrument, spans, found, edges, estimate(found, edges, self._axis), reference)

    def _doubt(self, seen: Seen) -> _Doubt | None:
        """Why this instrument shows nothing of the aircraft; None where it does."""
        if other := checks.other_axis(seen.levels, self._axis):
            return _Doubt(f"axes swapped: {other}", mistaken=True)
        why = self._shows_nothing(seen)
        return _Doubt(why) if why else None

    def _shows_nothing(self, seen: Seen) -> str:
        if other := checks.moved_alike(seen.levels, self._axis):
            return f"{self._name} and {other} were moved by one signal: excite one axis after another"
        if len(seen.estimate.frequency) < verdict.BANDS:
            return _too_little(seen)
        w = seen.estimate.frequency
        if checks.is_controller(w, seen.estimate.value * self._at(seen.reference, w), self._known.controllers):
            return f"this shows the controller (-1/C), not the aircraft: {verdict.DOUBLETS}"
        r, y = seen.instrument.values[:, self._axis], self._grid.rates[:, self._axis]
        if checks.follows_output([(np.diff(y[a:b]), r[a : b - 1]) for a, b in seen.spans], self._grid.dt):
            return f"the {seen.instrument.name} follows the aircraft and does not move it: {verdict.DOUBLETS}"
        return ""

    def _judged(self, first: Seen) -> AxisResult:
        data = self._data(first.estimate, first.reference)
        start = fit(data, (POLE, LAG, DELAY), best_start(data))
        reference = _reference(start)
        seen = self._seen(first.instrument, first.spans, reference)
        response = self._response(seen)
        if len(response.frequency) < verdict.BANDS:
            return self._refused(_Doubt(_too_little(seen)), response)
        richest = rigid(self._data(seen.estimate, reference), start.parameters)
        fine = self._fine(seen)
        resolved = seen.estimate
        bending = flexible(self._data(fine, reference), richest, self._modes) if _resolves(fine, resolved) else richest
        if len(bending.parameters) > MODES:  # which the reference must know, for a window widens what is sharp
            reference = _reference(bending)
            seen = self._seen(first.instrument, first.spans, reference)
            response, fine = self._response(seen), self._fine(seen)
            resolved = fine
            richest = fit(self._data(fine, reference), bending.free, bending.parameters)
        if stamps := early.doubt(richest):
            return self._refused(_Doubt(stamps, mistaken=True), response)
        chosen, reason = simplest(richest)
        width = spread(richest)
        between, gains = self._between(seen, chosen)
        apart = self._apart(seen, chosen)
        peaks = Peaks(self._data(fine, reference), fine.averages)
        between = max(between, apart.gain)
        off = np.hypot(between, resolved.frequency * apart.delay_s)
        limit = bound(chosen, richest, width, resolved.averages, off, peaks)
        model = self._model(seen, chosen, width, limit, (between, apart.delay_s), reason)
        why = (
            apart.why
            or verdict.not_one_aircraft(model, between, gains)
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
            mistaken=not apart.why and model.acceleration_per_unit.value <= 0.0,
        )

    def _fine(self, seen: Seen) -> Estimate:
        """What it shows at a resolution at which modes stand out."""
        found, edges = self._views.levels(seen.instrument, seen.spans, seen.reference, self._known.in_record, FINE)
        return estimate(found, edges, self._axis, gaps=True)

    def _data(self, found: Estimate, reference: Floats) -> Data:
        factor, wider = self._at(reference, found.frequency), found.wider
        return Data(
            found.frequency,
            found.value * factor,
            found.deviation * np.sqrt(wider) * np.abs(factor),
            self._known.in_record,
            self._grid.dt,
            found.rest * factor,
            found.weak * wider,
        )

    def _at(self, reference: Floats, frequency: Floats) -> np.ndarray:
        whole = reference_of(reference, self._known.in_record)
        return held_response(whole.num, whole.den, float(reference[DELAY]), self._grid.dt, frequency)

    def _response(self, seen: Seen) -> Response:
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
            loop=found.loop if seen.instrument.name == INJECTED else None,
        )

    def _part(self, seen: Seen, spans: Spans) -> Data | None:
        part = estimate(seen.levels, seen.edges, self._axis, spans)
        return self._data(part, seen.reference) if len(part.frequency) >= verdict.BANDS else None

    def _between(self, seen: Seen, chosen: Fit) -> tuple[float, Floats]:
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

    def _apart(self, seen: Seen, chosen: Fit) -> Between:
        """How several records differ, each by its own response."""
        shifts = []
        spans = parts(seen.spans, self._ends) if len(self._ends) > 1 else []
        for source, span in zip(self._sources, spans, strict=False):
            part = self._part(seen, (span,))
            if part is not None:
                model = chosen.gain * part.model(chosen.parameters)
                shifts.append((source, shift(part.frequency, part.value / model, part.deviation / np.abs(model))))
        return compared(shifts) if len(shifts) > 1 else Between()

    def _held_out(self, seen: Seen, chosen: Fit) -> tuple[float, float]:
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

    def _model(
        self, seen: Seen, chosen: Fit, width: Spread, limit: Bound, between: tuple[float, float], reason: str
    ) -> AxisModel:
        late, p = self._known.late_s, chosen.parameters
        gain = _interval(chosen.gain, width.gain[0], width.gain[1])
        apart, apart_s = 2.0 * between[0] * abs(chosen.gain), 2.0 * between[1]
        delay = _interval(p[DELAY] + late, *(width.parameters[DELAY] + late))
        misfit, chi2 = _misfit(chosen, chosen.data)
        held_out_misfit, held_out_chi2 = self._held_out(seen, chosen)
        return AxisModel(
            acceleration_per_unit=Interval(gain.value, gain.low - apart, gain.high + apart),
            slow_pole_rad_s=_interval(p[POLE], *width.parameters[POLE]),
            lag_s=_interval(p[LAG], *width.parameters[LAG]),
            delay_s=Interval(delay.value, max(0.0, delay.low - apart_s), delay.high + apart_s),
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


def _reference(found: Fit) -> Floats:
    reference = found.parameters.copy()
    reference[POLE] = max(reference[POLE], LEAST_POLE)
    return reference


def _too_little(seen: Seen) -> str:
    return f"too little excitation by the {seen.instrument.name}: {verdict.DOUBLETS}"


def _resolves(fine: Estimate, smooth: Estimate) -> bool:
    return len(fine.frequency) > len(smooth.frequency)


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

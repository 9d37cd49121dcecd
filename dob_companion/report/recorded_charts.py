"""The figures of a recorded flight's page."""

from itertools import pairwise

import numpy as np

from dob_companion.analysis.flight import OFF_STATES, ON_STATES, Spectrum, intervals_ms
from dob_companion.analysis.recorded import RecordedFlight
from dob_companion.artifact import AXES
from dob_companion.flightlog.flown import with_holes
from dob_companion.report.chart import Array, Band, Chart, Curve, Mark, Panel, Scale, envelope, symmetric
from dob_companion.supervisor import State

_WIDTH = 1120
_COLUMNS = 2000
"""Stretches of which a trace keeps its least and greatest value: what a zoomed screen can show of an hour."""

_MOST_MARKS = 30
_LEAST_COUNT = 0.7


def timeline(flight: RecordedFlight) -> Chart:
    """State, estimate and correction over time."""
    x = Scale("time", "s", 0.0, _end(flight))
    marks = _marks(flight)
    names = tuple(state.name for state in State)
    stairs = Curve("state", *_stairs(flight), "extra")
    panels = [
        Panel(
            0, 0, x, Scale("state", "", -0.4, len(names) - 0.6, names=names), (stairs,), marks=marks, title="DOB_STATE"
        )
    ]
    limit = symmetric([flight.d_hat, flight.correction])
    for i, axis in enumerate(AXES):
        curves = (
            _trace("estimate d̂", flight.told, flight.d_hat[:, i], "bound", 1.6),
            _trace("taken off by the correction", flight.time, -flight.correction[:, i], "on", 1.2),
        )
        panels.append(Panel(i + 1, 0, x, Scale("moment", "normalized", -limit, limit), curves, marks=marks, title=axis))
    alt = "State of the companion, and estimate and negative correction of three axes, over the whole flight."
    return Chart("timeline", alt, tuple(panels), _WIDTH, 760, row_heights=(1.4, 1.0, 1.0, 1.0))


def rates(flight: RecordedFlight) -> Chart:
    """Gyro rates over time, coloured by what the companion did."""
    panels = []
    x = Scale("time", "s", 0.0, _end(flight))
    limit = symmetric([flight.gyro])
    for i, axis in enumerate(AXES):
        values = flight.gyro[:, i]
        off, on = np.isin(flight.state, OFF_STATES), np.isin(flight.state, ON_STATES)
        curves = tuple(
            _trace(name, flight.time, np.where(kept, values, np.nan), role, 1.0)
            for name, kept, role in (
                ("DISABLED or TRACKING", off, "off"),
                ("ACTIVE", on, "on"),
                ("other states", ~(off | on), "bound"),
            )
            if np.any(kept)
        )
        scale = Scale("body rate", "rad/s", -limit, limit)
        panels.append(Panel(i, 0, x, scale, curves, marks=_restarts(flight), title=axis))
    return Chart("rates", "Gyro rates of three axes.", tuple(panels), _WIDTH, 560, row_heights=(1.0, 1.0, 1.0))


def spectra(off: Spectrum, on: Spectrum) -> Chart:
    """Amplitude spectra of the gyro rates without and with the observer."""
    panels = []
    shown = [np.sqrt(each.density[1:]) for each in (off, on)]
    peak = float(max(np.max(each) for each in shown))
    floor = max(1e-4 * peak, 1e-9)
    y = Scale("body rate", "rad/s/√Hz", floor, max(1.5 * peak, 10.0 * floor), log=True)
    x = Scale("frequency", "Hz", float(off.hz[1]), float(off.hz[-1]), log=True)
    for i, axis in enumerate(AXES):
        curves = (
            Curve("DISABLED or TRACKING", off.hz[1:], np.maximum(shown[0][:, i], floor), "off"),
            Curve("ACTIVE", on.hz[1:], np.maximum(shown[1][:, i], floor), "on"),
        )
        panels.append(Panel(0, i, x, y, curves, title=axis))
    alt = "Amplitude spectra of the gyro rates, observer off and on, three axes."
    return Chart("spectra", alt, tuple(panels), _WIDTH, 380, col_widths=(1.0, 1.0, 1.0))


def histograms(flight: RecordedFlight) -> Chart:
    """Sample intervals, delays and turns of the loop: how often each occurred."""
    steps, ages, turns = intervals_ms(flight), flight.ages[np.isfinite(flight.ages)], 1e6 * flight.took
    longest = max(3.0 * float(np.median(steps)), 1.0)
    oldest = min(max(float(np.max(ages, initial=0.0)), 4.0), 30.0)
    slowest = 10.0 ** np.ceil(np.log10(max(float(np.max(turns, initial=0.0)), 100.0)))
    panels = (
        _histogram(0, "interval of gyro stamps", "ms", np.clip(steps, 0.0, longest), np.linspace(0.0, longest, 121)),
        _histogram(1, "age of corrections", "samples", np.clip(ages, 0.0, oldest), np.arange(-0.5, oldest + 1.0)),
        _histogram(
            2,
            "turn of the loop",
            "µs",
            np.clip(turns, 10.0, slowest),
            np.geomspace(10.0, slowest, 81),
            log=True,
        ),
    )
    alt = "Histograms of sample intervals, of the age of corrections and of the loop's turns."
    return Chart("histograms", alt, panels, _WIDTH, 340, col_widths=(1.0, 1.0, 1.0))


def _histogram(col: int, label: str, unit: str, values: Array, edges: Array, *, log: bool = False) -> Panel:
    counts, _ = np.histogram(values, edges)
    x = np.repeat(edges, 2)[1:-1]
    heights = np.maximum(np.repeat(counts.astype(np.float64), 2), _LEAST_COUNT)
    top = 10.0 ** np.ceil(np.log10(max(float(heights.max(initial=1.0)), 10.0)))
    band = Band("how often", x, np.full_like(x, _LEAST_COUNT), heights, "on")
    scale = Scale(label, unit, float(edges[0]), float(edges[-1]), log=log)
    curve = Curve("", x, heights, "on", width=1.0)
    return Panel(0, col, scale, Scale("count", "", _LEAST_COUNT, float(top), log=True), (curve,), (band,))


def _trace(name: str, time: Array, values: Array, role: str, width: float) -> Curve:
    """A curve that keeps its peaks, and its gaps, in a few thousand points."""
    if not np.any(np.isfinite(values)):
        return Curve(name, np.zeros(0), np.zeros(0), role, width=width)
    time, values = with_holes(time, values)
    edges = [0, *(np.flatnonzero(np.diff(np.isfinite(values).astype(np.int8))) + 1).tolist(), len(values)]
    xs, ys = [], []
    for a, b in pairwise(edges):
        if not np.isfinite(values[a]):
            continue
        x, y = envelope(time[a:b], values[a:b], max(2, round(_COLUMNS * (b - a) / len(values))))
        xs += [x, time[b - 1 : b]]
        ys += [y, np.array([np.nan])]
    return Curve(name, np.concatenate(xs), np.concatenate(ys), role, width=width)


def _stairs(flight: RecordedFlight) -> tuple[Array, Array]:
    """The state from the first sample to the end of the recording, whether samples came or not."""
    shown = [change for change in flight.changes if change.time > 0.0]
    times = np.array([0.0, *(change.time for change in shown), flight.seconds])
    levels = np.array([flight.state[0], *(change.state for change in shown)], dtype=np.float64)
    return np.repeat(times, 2)[1:-1], np.repeat(levels, 2)


def _marks(flight: RecordedFlight) -> tuple[Mark, ...]:
    """A line at each change of state, unless there are too many, and at each restart."""
    busy = len(flight.changes) > _MOST_MARKS
    changes = () if busy else tuple(Mark(x=change.time) for change in flight.changes if change.time > 0.0)
    return (*changes, *_restarts(flight))


def _restarts(flight: RecordedFlight) -> tuple[Mark, ...]:
    return tuple(Mark(x=time, label="clock restarts") for time in flight.restarts)


def _end(flight: RecordedFlight) -> float:
    return float(np.ceil(flight.seconds * 10.0) / 10.0)

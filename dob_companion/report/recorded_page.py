"""The page of a recorded flight: what the companion did and why, how well the link did, and what changed with it on."""

import numpy as np

from dob_companion.analysis.flight import (
    BANDS_HZ,
    OFF_STATES,
    ON_STATES,
    Quantiles,
    Spectrum,
    spectrum,
    summary,
    time_in_states,
    without_samples,
)
from dob_companion.analysis.recorded import RecordedFlight
from dob_companion.artifact import AXES
from dob_companion.companion.parameters import in_words
from dob_companion.flightlog.flown import happenings
from dob_companion.report import recorded_charts as charts
from dob_companion.report.page import PageFigure, figure, render
from dob_companion.report.words import number, plural

MOST_CHANGES = 12
"""Changes of state up to which they are told one by one."""


def recorded_page(flight: RecordedFlight, name: str) -> str:
    """Self-contained HTML of one recorded flight; `name` is what it is called in the title."""
    off, on = spectrum(flight, OFF_STATES), spectrum(flight, ON_STATES)
    return render(
        "recorded.html.j2",
        title=f"Recorded flight: {name}",
        generator=flight.generator,
        design=flight.design,
        meta=[
            f"began {flight.started}",
            f"{number(flight.seconds, 4)} s",
            f"design {flight.design[:8]}",
            flight.machine,
        ],
        facts=_facts(flight),
        states=_states(flight),
        changes=[(f"{change.time:.3f}", change.state.name, change.reason) for change in flight.changes],
        happened=_happened(flight),
        settings=_settings(flight),
        timeline=_timeline(flight),
        rates=_rates(flight),
        histograms=_histograms(flight),
        comparison=_comparison(off, on) if off and on else [],
        seconds=(number(off.seconds, 3), number(on.seconds, 3)) if off and on else None,
        missing=_missing(off, on),
        spectra=_spectra(off, on) if off and on else None,
    )


def _facts(flight: RecordedFlight) -> list[tuple[str, str]]:
    told = summary(flight)
    holes = f"{plural(told.holes, 'hole')} in the samples, {_seconds(told.without_samples_s)} s in all"
    return [
        ("gyro samples", f"{told.samples}, {told.answered} of them answered"),
        ("sample rate", f"{number(told.rate_hz, 4, 'Hz')} on the vehicle's stamps, holes left out"),
        ("holes", holes if told.without_samples_s > 0.0 else "none in the samples"),
        *(("restart", f"the vehicle's clock began anew at {_seconds(at)} s") for at in flight.restarts),
        ("delay", _quantiles(told.age_samples, "samples") + ", the age of a correction when it acts"),
        ("turn of the loop", _quantiles(told.turn_s, "µs", 1e6) + ", from waking to the last byte sent"),
        ("largest correction", number(told.largest, 3) + " of normalized torque"),
        ("not recorded", plural(flight.lost, "turn") + " of the loop"),
    ]


def _quantiles(of: Quantiles | None, unit: str, scale: float = 1.0) -> str:
    if of is None:
        return "unknown"
    median, p99, most = scale * of.median, scale * of.p99, scale * of.most
    return f"median {number(median, 3)}, p99 {number(p99, 3)}, most {number(most, 3, unit)}"


def _states(flight: RecordedFlight) -> list[tuple[str, str, str]]:
    times = time_in_states(flight)
    total = flight.seconds or 1.0
    rows = [(state.name, time) for state, time in times.items()]
    if (lost := without_samples(flight)) > 0.0:
        rows.append(("no samples", lost))
    return [(name, _seconds(time), f"{100.0 * time / total:.1f}") for name, time in rows]


def _happened(flight: RecordedFlight) -> list[tuple[str, str, str, str]]:
    """Many changes told shortly: what, how often, from when to when. Empty where a plain list is short enough."""
    if len(flight.changes) <= MOST_CHANGES:
        return []
    rows = []
    for one in happenings(flight.changes):
        when = _seconds(one.first) if one.times == 1 else f"{_seconds(one.first)} … {_seconds(one.last)}"
        rows.append((one.state.name, one.reason, "once" if one.times == 1 else f"{one.times} times", when))
    return rows


def _settings(flight: RecordedFlight) -> list[tuple[str, str, str]]:
    return [
        (
            "start" if np.isinf(one.time) else _seconds(one.time),
            one.name,
            f"{one.value:g}" + (f" ({words})" if (words := in_words(one.name, one.value)) else ""),
        )
        for one in flight.settings
    ]


def _seconds(value: float) -> str:
    return f"{value:.2f}".replace("-", "−")


def _comparison(off: Spectrum, on: Spectrum) -> list[tuple[str, list[tuple[str, str, str]]]]:
    """Rows of the table: a band, and per axis RMS off, RMS on and their ratio."""
    named = [("all", None), *((f"{low:g}–{high:g} Hz", (low, high)) for low, high in BANDS_HZ)]
    rows = []
    for label, band in named:
        before, after, ratios = off.rms(band), on.rms(band), off.over(on, band)
        cells = [(number(before[i], 3), number(after[i], 3), number(ratios[i], 3)) for i in range(len(AXES))]
        rows.append((label, cells))
    return rows


def _missing(off: Spectrum | None, on: Spectrum | None) -> str:
    lacking = [words for words, found in (("DISABLED or TRACKING", off), ("ACTIVE", on)) if found is None]
    return f"nowhere long enough in {' nor in '.join(lacking)}" if lacking else ""


def _timeline(flight: RecordedFlight) -> PageFigure:
    return figure(
        charts.timeline(flight),
        "What it did.",
        "State, the estimate d_hat as sent by telemetry, and what the answers to the gyro samples took off the moment: "
        "minus the correction f · a · clip(−g · d_hat, ±limit), so that both lie on each other where nothing is faded "
        "or limited. All three axes on one scale; where nothing came, nothing is drawn.",
    )


def _rates(flight: RecordedFlight) -> PageFigure:
    return figure(
        charts.rates(flight), "Body rates.", "What the gyro measured, coloured by what the companion did at the time."
    )


def _histograms(flight: RecordedFlight) -> PageFigure:
    return figure(
        charts.histograms(flight),
        "The link and the loop.",
        "How often each interval between two gyro stamps, each age of a correction in the moment applied, and each "
        "length of a turn of the loop occurred. Counts are on a logarithmic scale, so that the rare ones show.",
    )


def _spectra(off: Spectrum, on: Spectrum) -> PageFigure:
    return figure(
        charts.spectra(off, on),
        "Spectra of the body rates.",
        "Amplitude spectral density (Welch, stretches of 1024 samples), without and with the observer.",
    )

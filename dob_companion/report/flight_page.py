"""The page of a flight: the table, and the paper's Figs. 7–13 redrawn from our own data."""

from collections.abc import Mapping
from typing import Any

from dob_companion.analysis.design import axis_responses
from dob_companion.artifact import AXES, DobDesign
from dob_companion.report import bode_charts, flight_charts
from dob_companion.report.design_page import certificate_row, dates
from dob_companion.report.page import PageFigure, figure, render
from dob_companion.report.trace import FlightTrace
from dob_companion.report.words import listed, number, plural


def flight_page(design: DobDesign, result: Mapping[str, Any], trace: FlightTrace) -> str:
    """Self-contained HTML of one flight.

    `result` is result.json as docs/interfaces.md defines it; its numbers are printed, none is computed again.
    """
    return render(
        "flight.html.j2",
        title="Observer off, observer on: one flight",
        generator=design.generator,
        sha256=design.sha256,
        lead=_lead(result),
        meta=_meta(design, result),
        rows=[_row(axis, result["axes"][axis]) for axis in AXES if axis in result["axes"]],
        paper=_beside_paper(result),
        checks=[_check(check) for check in result.get("checks", [])],
        facts=_facts(design, result),
        overview=_overview(trace),
        time_figures=_time_figures(trace, beside_paper=_beside_paper(result)),
        frequency_figures=_frequency_figures(design),
        blocks=[certificate_row(block) for block in design.blocks],
    )


def _beside_paper(result: Mapping[str, Any]) -> bool:
    """Whether the scenario is one of the paper's."""
    return any(numbers["paper_ratio"] is not None for numbers in result["axes"].values())


def _lead(result: Mapping[str, Any]) -> str:
    axes = [axis for axis in AXES if axis in result["axes"] and result["axes"][axis]["rms_ratio"] is not None]
    gains = tuple(f"{number(result['axes'][axis]['rms_ratio'], 2)} ({axis})" for axis in axes)
    return (
        "With the disturbance observer switched on in mid-flight, under the same disturbance and noise, "
        f"the RMS attitude error falls by a factor of {listed(gains)}."
    )


def _meta(design: DobDesign, result: Mapping[str, Any]) -> list[str]:
    return [
        f"scenario {result['scenario']}",
        f"seed {result['seed']}",
        f"{result['clock']} clock",
        *dates(design),
    ]


def _row(axis: str, numbers: Mapping[str, float]) -> dict[str, str]:
    cells = {name: number(numbers[name], 4) for name in ("peak_off", "peak_on", "rms_off", "rms_on")}
    ratios = {name: number(numbers[name], 3) for name in ("peak_ratio", "rms_ratio")}
    paper = numbers["paper_ratio"]
    return {"axis": axis, "paper_ratio": "–" if paper is None else f"{paper:g}", **cells, **ratios}


def _check(check: Mapping[str, Any]) -> dict[str, str]:
    numbers = {name: number(check[name], 4) for name in ("value", "at_least", "at_most")}
    return {"name": check["check"], "verdict": "yes" if check["passed"] else "no", **numbers}


def _facts(design: DobDesign, result: Mapping[str, Any]) -> list[tuple[str, str]]:
    delay, lost, sent = result["delay_samples"], result["samples_lost"], result["samples"]
    measured = "no correction came"
    if delay is not None:
        ms = f"{delay * design.dt * 1e3:g} ms"
        measured = f"{plural(delay, 'sample')} ({ms}), the median age of a correction when it acts"
    return [
        ("delay, measured", measured),
        ("delay, designed for", plural(design.delay_samples, "sample")),
        ("sample rate", number(result["rate_hz"], 5, "Hz")),
        ("samples lost", f"{lost} of {sent}"),
    ]


def _overview(trace: FlightTrace) -> PageFigure:
    return figure(
        flight_charts.overview(trace),
        "The flight.",
        "Attitude error as flown. Once the off window is over a ground client writes the parameter DOB_ENABLE and the "
        "observer fades in. Then the same disturbance and noise begin again from rest; what lies between the "
        "windows is left out of the table.",
    )


def _time_figures(trace: FlightTrace, *, beside_paper: bool) -> list[PageFigure]:
    charts = [flight_charts.figure_11(trace), flight_charts.figure_12(trace), flight_charts.figure_13(trace)]
    words = _OF_THE_PAPER if beside_paper else _OF_ANY_FLIGHT
    return [figure(chart, name, text) for chart, (name, text) in zip(charts, words, strict=True)]


_OF_THE_PAPER = (
    (
        "Fig. 11. Attitude errors, observer off.",
        "The paper shows the three attitude errors of its simulation with the DOB turned off, peaks 0.15 (roll), "
        "0.12 (pitch) and 0.12 rad (yaw). Ours are those of the off window, the mean of each removed as in the table.",
    ),
    (
        "Fig. 12. Attitude errors, observer on.",
        "The paper shows the same with the DOB turned on, peaks 0.02 (roll), 0.01 (pitch) and 0.02 rad (yaw), "
        "without a link between observer and actuator. Ours cross a MAVLink link: at left on the scale of Fig. 11, "
        "at right enlarged.",
    ),
    (
        "Fig. 13. Disturbance and estimate.",
        "The paper shows the disturbance added along its three body axes and the estimate of the DOB. Ours are the "
        "disturbance of the simulated vehicle and d̂ as the vehicle applied it, that is minus the correction, "
        "delay included; at right a few seconds of the same.",
    ),
)

_OF_ANY_FLIGHT = (
    ("Attitude errors, observer off.", "The off window, the mean of each removed as in the table."),
    ("Attitude errors, observer on.", "The on window: at left on the scale of the figure before, at right enlarged."),
    (
        "Disturbance and estimate.",
        "What the scenario adds at the plant's input, and d̂ as the vehicle applied it, that is minus the correction, "
        "delay included; at right a few seconds of the same. Wind, loads and faults act elsewhere and are not in the "
        "first, but the observer answers to them.",
    ),
)


def _frequency_figures(design: DobDesign) -> list[PageFigure]:
    views = [view for block in design.blocks for view in axis_responses(block, design.dt)]
    axes = sorted(views, key=lambda view: AXES.index(view.axis))
    charts = bode_charts
    return [
        figure(
            charts.figure_7("fig7", axes),
            "Fig. 7. Q and the inverse model.",
            "The paper shows Q, Gₙ⁻¹ and G⁻¹ of the pitch axis without link delay; its Gₙ⁻¹ matches G⁻¹ from 0.1 to "
            "25 Hz. Ours are the three axes as flown, designed for the link's delay; being deaf to commands makes "
            "Gₙ⁻¹ = G⁻¹ at every frequency, so the two curves lie on each other.",
        ),
        figure(
            charts.figure_8("fig8", axes),
            "Fig. 8. Disturbance to estimate.",
            "The paper shows the Bode diagram d → d̂, close to 0 dB up to 25 Hz. Ours adds the error that is left once "
            "the link's delay is counted, under the level γ / |W_d| that the certificate guarantees.",
        ),
        figure(
            charts.figure_9("fig9", axes),
            "Fig. 9. Disturbance to body rate.",
            "The paper shows d → body rate, attenuated by its DOB below 10 Hz. Ours is the same loop, observer off and "
            "on, with the link's delay; dB of rad/s per normalized torque.",
        ),
        figure(
            charts.figure_10("fig10", axes),
            "Fig. 10. Noise to estimate.",
            "The paper shows n → d̂, below 0 dB at all frequencies. Ours is drawn with the level γ / |W_n| that the "
            "certificate guarantees; dB of normalized torque per rad/s.",
        ),
    ]

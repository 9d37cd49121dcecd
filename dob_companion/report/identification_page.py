"""The page of an identification: each axis' model with its intervals, its responses, and what to do next in words."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from dob_companion.identification.result import AxisModel, AxisResult, Identification, Interval
from dob_companion.identification.surroundings import Surroundings
from dob_companion.report.identification_charts import misfit_chart, response_chart
from dob_companion.report.page import PageFigure, figure, render
from dob_companion.report.words import listed, number

LEAST_NOISE = 1e-6
"""rad/s; no gyro on an aircraft has less, a simulated one may."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisSection:
    """One axis as its section of the page shows it."""

    name: str
    usable: bool
    why: str
    facts: list[tuple[str, str]]
    figures: list[PageFigure]


def identification_page(
    found: Identification, surroundings: Mapping[str, Surroundings | None], generator: str, files: tuple[str, ...] = ()
) -> str:
    """Self-contained HTML. `files` names what was written beside it."""
    sections = [_section(result, surroundings.get(axis)) for axis, result in found.axes.items()]
    return render(
        "identification.html.j2",
        title="Identified aircraft",
        generator=generator,
        meta=[found.source, f"{found.rate_hz:g} Hz", *([f"usable: {listed(found.usable)}"] if found.usable else [])],
        rows=[_row(result) for result in found.axes.values()],
        sections=sections,
        segments=[(number(each.begin, 4), number(each.end, 4), each.why or "used") for each in found.segments],
        remarks=found.remarks,
        files=files,
        any_usable=bool(found.usable),
    )


def _row(result: AxisResult) -> tuple[str, str, str, str, str, str]:
    model = result.model
    if model is None:
        return (result.axis, "–", "–", "–", "–", "no")
    return (
        result.axis,
        _said(model.acceleration_per_unit),
        _said(model.slow_pole_rad_s),
        _said(model.lag_s, 1e3),
        _said(model.delay_s, 1e3),
        "yes" if result.usable else "no",
    )


def _said(interval: Interval, scale: float = 1.0) -> str:
    value, low, high = (number(scale * x, 3) for x in (interval.value, interval.low, interval.high))
    return value if low == high else f"{value} ({low} … {high})"


def _section(result: AxisResult, around: Surroundings | None) -> AxisSection:
    facts: list[tuple[str, str]] = []
    figures: list[PageFigure] = []
    model, response = result.model, result.response
    if model is not None:
        facts += _facts(model)
    if around is not None:
        spectrum = f"corner {_said(around.corner_hz)} Hz" if around.shows_corner else "too calm to show its spectrum"
        facts += [
            (
                "gyro noise",
                f"{_said(around.noise_rms)} rad/s RMS" if around.noise_rms.value > LEAST_NOISE else "none seen",
            ),
            ("disturbance", f"{_said(around.disturbance_rms)} RMS, {spectrum}"),
        ]
    if response is not None:
        together = f", {listed(response.axes)} together" if len(response.axes) > 1 else ""
        facts.append(("instrument", f"{response.instrument}{together}"))
        caption = (
            "From the torque that acted to the rate that the link shows. "
            "A response that lies on −1/C is that of the controller, not of the aircraft."
        )
        figures.append(figure(response_chart(f"{result.axis}-response", response, model), "Response.", caption))
    if model is not None and response is not None:
        caption = (
            "The design is made for every aircraft within the dashed bound: what is not known of the parameters, what "
            "the form of the model leaves, and what was not measured."
        )
        if model.modes:
            caption += " Its plant is the model without flexible modes; what they do is added to the bound."
        figures.append(figure(misfit_chart(f"{result.axis}-misfit", response, model), "Misfit and bound.", caption))
    return AxisSection(name=result.axis, usable=result.usable, why=result.why, facts=facts, figures=figures)


def _facts(model: AxisModel) -> list[tuple[str, str]]:
    facts = [
        ("structure", f"{model.structure}: {model.why}" if model.why else model.structure),
        ("misfit", f"{number(100.0 * model.misfit, 2)} % RMS, χ² {number(model.chi2, 2)}"),
    ]
    if not math.isnan(model.held_out_misfit):
        held_out = f"{number(100.0 * model.held_out_misfit, 2)} % RMS, χ² {number(model.held_out_chi2, 2)}"
        facts.append(("held-out data", held_out))
    if model.about_filters:
        facts.append(("known filters", "; ".join(model.about_filters)))
    facts += [("mode", f"{_said(m.frequency_hz)} Hz, damping {_said(m.damping)}") for m in model.modes]
    return facts

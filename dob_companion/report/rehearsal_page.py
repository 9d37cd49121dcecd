"""The page of a rehearsal: off and on of every aircraft of the family, and the flights of two of them."""

from collections.abc import Mapping
from typing import Any

from dob_companion.artifact import AXES, DobDesign
from dob_companion.report import flight_charts
from dob_companion.report.design_page import certificate_row, dates
from dob_companion.report.page import PageFigure, figure, render
from dob_companion.report.trace import FlightTrace
from dob_companion.report.words import listed, number, plural


def rehearsal_page(design: DobDesign, found: Mapping[str, Any], traces: Mapping[str, FlightTrace]) -> str:
    """Self-contained HTML of a rehearsal.

    `found` is rehearsal.json as docs/interfaces.md defines it; its numbers are printed, none is computed again.
    `traces` are the flights that are drawn, by the name of the aircraft.
    """
    axes = [axis for axis in AXES if axis in found["members"][0]["axes"]]
    return render(
        "rehearsal.html.j2",
        title="Rehearsal: the design over its family of plants",
        generator=design.generator,
        sha256=design.sha256,
        meta=[plural(len(found["members"]), "aircraft").replace("aircrafts", "aircraft"), *dates(design)],
        lead=_lead(found),
        axes=axes,
        rows=[_row(member, axes) for member in found["members"]],
        figures=[_figure(name, trace) for name, trace in traces.items()],
        blocks=[certificate_row(block) for block in design.blocks],
    )


def _lead(found: Mapping[str, Any]) -> str:
    if not found["usable"]:
        wrong = tuple(member["name"] for member in found["members"] if not member["passed"])
        return f"Not usable as it is: {listed(wrong)} failed."
    return (
        "Usable: every aircraft of the family flew to the end with the observer on throughout, and its attitude error "
        f"was no larger than with the observer off. The least was gained with: {found['weakest']}."
    )


def _row(member: Mapping[str, Any], axes: list[str]) -> dict[str, Any]:
    cells = []
    for axis in axes:
        numbers = member["axes"][axis]
        cells += [number(numbers[key] if numbers else None, 3) for key in ("rms_off", "rms_on", "rms_ratio")]
    changed = member["changed"]
    same = len(set(changed.values())) == 1
    words = next(iter(changed.values())) if same else "; ".join(f"{axis}: {text}" for axis, text in changed.items())
    return {"name": member["name"], "changed": words, "cells": cells, "verdict": member["why"] or "ok"}


def _figure(name: str, trace: FlightTrace) -> PageFigure:
    key = name.replace(" ", "-")
    chart = flight_charts.overview(trace, f"overview-{key}")
    return figure(
        chart, f"{name}.", "Attitude error as flown, observer off and then on, under the same disturbance and noise."
    )

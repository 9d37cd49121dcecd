"""The page and the picture of a comparison: what each method attains, what it costs, where it fails."""

import io
import math
import re
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import dob_companion
from dob_companion.comparison import OFF_NOMINAL, AxisComparison, Row
from dob_companion.comparison.table import RULE, UNTUNED, cells, verdicts
from dob_companion.report.chart import Chart, Curve, Panel, Scale
from dob_companion.report.page import PageFigure, figure, render
from dob_companion.report.palette import COLOURS, INK, MUTED, PAPER
from dob_companion.report.palette import RULE as LINE
from dob_companion.report.words import listed, number, plural

_COLUMNS = (
    ("attenuation", "RMS off / on"),
    ("peak, rad", "observer on"),
    ("n→d̂ peak", "torque per rad/s"),
    ("n→d̂ RMS", "torque"),
    ("disk", "margin"),
    ("delay", "samples"),
    ("order", "states"),
    *((name, "RMS off / on") for name, _ in OFF_NOMINAL),
)
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "comparison",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.6,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": INK,
}
_HOLLOW: dict[str, Any] = {"linestyle": "none", "markeredgewidth": 1.0, "markerfacecolor": "none"}
_MARKS = {
    name: _HOLLOW | {"marker": marker, "markersize": size}
    for (name, _), marker, size in zip(OFF_NOMINAL, "<>os", (7.0, 7.0, 5.5, 4.5), strict=True)
}
_DOT: dict[str, Any] = {"marker": "o", "markersize": 3.5}
_BESIDE, _BEYOND = 8.0, 40.0
"""Points between a method's marks and its number or the words at the left, and from its marks to words at the right."""
_NUMBER_SIZE, _WORDS_SIZE = 8.5, 8.0
_DPI = 200


@dataclass(frozen=True, slots=True)
class _Line:
    key: str
    name: str
    cells: list[str]
    settings: str
    source: str


def comparison_page(axes: tuple[AxisComparison, ...], spec: str) -> str:
    """Self-contained HTML; every number on it is one of the comparison's own. `spec` names what was compared."""
    flights = len(axes[0].rows[0].attenuation)
    return render(
        "comparison.html.j2",
        title=f"Disturbance observers compared: {listed(tuple(axis.axis for axis in axes))}",
        generator=f"dob-companion {dob_companion.__version__}",
        meta=[spec, f"{1.0 / axes[0].dt:g} Hz", plural(flights, "flight") + " of each observer"],
        lead=_lead(axes),
        rule=RULE,
        untuned=UNTUNED,
        columns=_COLUMNS,
        sections=[_section(axis) for axis in axes],
    )


def comparison_png(axis: AxisComparison) -> bytes:
    """The overview of one axis as a PNG, 1600 pixels wide."""
    with mpl.rc_context(_STYLE):
        out = io.BytesIO()
        _overview(axis).savefig(out, format="png", dpi=_DPI, metadata={"Software": None})
    return out.getvalue()


def _lead(axes: tuple[AxisComparison, ...]) -> str:
    found = dict.fromkeys(axis.best.name for axis in axes)
    words = [
        f"{name} ({listed(tuple(f'{number(a.best.mean, 3)} on {a.axis}' for a in axes if a.best.name == name))})"
        for name in found
    ]
    return (
        f"With no more noise in the correction and no smaller a disk margin, most attenuation: {listed(tuple(words))}."
    )


def _section(axis: AxisComparison) -> dict[str, Any]:
    return {
        "axis": axis.axis,
        "verdicts": verdicts(axis),
        "absent": axis.absent,
        "rows": [_line(row) for row in axis.rows if row.tuned],
        "plain": [_line(row) for row in axis.rows if not row.tuned],
        "overview": _svg(axis),
        "responses": _responses(axis),
    }


def _line(row: Row) -> _Line:
    text = cells(row)
    return _Line(row.key, row.name, [text[name] for name, _ in _COLUMNS], row.settings, row.source)


def _responses(axis: AxisComparison) -> PageFigure:
    """|d -> d - z^-τ d_hat| of each method in a panel of its own, the H∞ design's behind it."""
    shown = axis.hertz >= 0.1
    hertz = axis.hertz[shown]
    reference = next(row for row in axis.rows if row.key == "hinf")
    others = [row for row in axis.rows if row.key not in ("off", "hinf")]
    columns = 4
    x, y = Scale("frequency", "Hz", 0.1, float(hertz[-1]), log=True), Scale("error", "dB", -60.0, 40.0, step=20.0)
    panels = []
    for i, row in enumerate(others):
        curves = (
            Curve(reference.name, hertz, _decibels(reference.error[shown]), "on", width=2.4),
            Curve("the method", hertz, _decibels(row.error[shown]), "off"),
        )
        panels.append(Panel(i // columns, i % columns, x, y, curves, title=row.name))
    rows = -(-len(others) // columns)
    chart = Chart(
        f"{axis.axis}-error",
        "What each observer leaves of a disturbance, over frequency.",
        tuple(panels),
        1140,
        60 + 230 * rows,
        (1.0,) * rows,
        (1.0,) * min(columns, len(others)),
    )
    return figure(
        chart,
        "What is left of a disturbance.",
        "|d → d − z^−τ d_hat|, link delay included, nominal plant. Below 0 dB the observer helps, above it harms.",
    )


def _decibels(size: Any) -> Any:
    return 20.0 * np.log10(np.maximum(size, 1e-6))


def _svg(axis: AxisComparison) -> Markup:
    with mpl.rc_context(_STYLE):
        out = io.StringIO()
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        _overview(axis).savefig(out, format="svg", metadata=nothing, transparent=True)
    text = out.getvalue()
    text = re.sub(r'\bid="', f'id="{axis.axis}-overview-', text[text.index("<svg") :])
    text = re.sub(r'(href="#|url\(#)', rf"\g<1>{axis.axis}-overview-", text)
    return Markup(text)  # matplotlib escapes text


def _overview(axis: AxisComparison) -> Figure:
    """Three columns over the same list of methods: attenuation, its noise, its margin."""
    rows = [row for row in axis.rows if row.tuned and row.key != "off"]
    rows = sorted(rows, key=lambda row: -row.mean) + [row for row in axis.rows if not row.tuned]
    tuned = sum(row.tuned for row in rows)
    at = [i + 0.7 * (i >= tuned) for i in range(len(rows))]
    figure = Figure(figsize=(8.0, 1.25 + 0.31 * at[-1]), dpi=_DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)
    grid = {"left": 0.235, "right": 0.985, "top": 0.82, "bottom": 0.16, "wspace": 0.12, "width_ratios": (2.6, 1, 1)}
    columns = figure.subplots(1, 3, sharey=True, gridspec_kw=grid)
    titles = ("attenuation: RMS attitude error, off / on", "noise in d̂, RMS", "disk margin")
    for axes, title in zip(columns, titles, strict=True):
        _frame(axes, title, rows, at)
    needs = [_needs(columns[0], row) for row in rows]
    low, high = _limits(rows, needs)
    for place, row, needed in zip(at, rows, needs, strict=True):
        _row(columns, row, place, left=_room_at_left(row, needed, low, high))
    _scales(columns, rows, low, high)
    if tuned < len(rows):
        columns[0].text(-0.01, at[tuned] - 0.85, UNTUNED, transform=columns[0].get_yaxis_transform(), ha="right",
                        va="center", fontsize=8, style="italic", color=MUTED)  # fmt: skip
    _legend(columns[0])
    text = f"Observers at the same noise and disk margin: {axis.axis}, link delay {plural(axis.delay, 'sample')}"
    figure.text(0.012, 0.955, text, fontsize=11, weight="bold", va="center")
    return figure


def _frame(axes: Axes, title: str, rows: list[Row], at: list[float]) -> None:
    axes.set_title(title, loc="left", fontsize=9, color=MUTED, pad=4)
    axes.set_yticks(at, [row.name for row in rows])
    axes.set_ylim(at[-1] + 0.6, -0.6)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
    axes.grid(True, axis="y", color=LINE, linewidth=0.6)
    axes.set_axisbelow(True)


def _row(columns: Any, row: Row, place: float, *, left: bool) -> None:
    """One method; `left` says on which side of its marks there is room for words."""
    colour = COLOURS["on"] if row.key == "hinf" else INK if row.tuned else MUTED
    first, noise, disk = columns
    for name, value in row.off_nominal.items():
        if value is not None:
            first.plot(value, place, color=colour, **_MARKS[name])
    first.plot(row.mean, place, color=colour, **_DOT)
    label: dict[str, Any] = {"textcoords": "offset points", "fontsize": _NUMBER_SIZE, "va": "center"}
    first.annotate(f"{row.mean:.2f}", (_reach(row)[1], place), (_BESIDE, 0), color=colour, **label)
    if words := _unstable(row):
        label |= {"fontsize": _WORDS_SIZE, "color": COLOURS["off"]}
        if left:
            first.annotate(words, (_reach(row)[0], place), (-_BESIDE, 0), ha="right", **label)
        else:
            first.annotate(words, (_reach(row)[1], place), (_BEYOND, 0), **label)
    noise.plot(row.noise_rms, place, color=colour, **_DOT)
    disk.plot(row.disk_margin, place, color=colour, **_DOT)


def _reach(row: Row) -> tuple[float, float]:
    """Least and largest attenuation drawn of a method."""
    reached = [row.mean, *(value for value in row.off_nominal.values() if value is not None)]
    return min(reached), max(reached)


def _unstable(row: Row) -> str:
    """Where a method is unstable, in words; "" when nowhere."""
    names = ", ".join(name for name, value in row.off_nominal.items() if value is None)
    for long, short in (("gain −30 %, gain +30 %", "gain ±30 %"), (", delay", ",")):
        names = names.replace(long, short)
    return f"unstable: {names}" if names else ""


@dataclass(frozen=True, slots=True)
class _Needs:
    """Shares of the attenuation's axis that a method's words take: its number, and where it is unstable when that
    stands at the left of its marks, or at the right of them together with the number."""

    number: float
    left: float
    right: float


def _needs(axes: Axes, row: Row) -> _Needs:
    """Measured as drawn, with a little air at the end."""
    whole, point, words = axes.get_window_extent().width, axes.figure.dpi / 72.0, _unstable(row)

    def share(text: str, size: float, distance: float) -> float:
        probe = axes.text(0.0, 0.0, text, fontsize=size)
        width = probe.get_window_extent().width
        probe.remove()
        return float((width + (distance + 2.0) * point) / whole)

    number = share(f"{row.mean:.2f}", _NUMBER_SIZE, _BESIDE)
    if not words:
        return _Needs(number, 0.0, number)
    return _Needs(number, share(words, _WORDS_SIZE, _BESIDE), share(words, _WORDS_SIZE, _BEYOND))


def _limits(rows: list[Row], needs: list[_Needs]) -> tuple[float, float]:
    """Of the attenuation's axis, logarithmic: as far to the right as each method's words need."""
    low = min(_reach(row)[0] for row in rows) / 1.25

    def highest(shares: list[float]) -> float:
        reached = [_reach(row)[1] / low for row in rows]
        return max(float(low * reach ** (1.0 / (1.0 - share))) for reach, share in zip(reached, shares, strict=True))

    high = max(highest([needed.number for needed in needs]), 1.5 * low)
    if all(_room_at_left(row, needed, low, high) for row, needed in zip(rows, needs, strict=True)):
        return low, high
    return low, highest([needed.right for needed in needs])


def _room_at_left(row: Row, needed: _Needs, low: float, high: float) -> bool:
    return math.log(_reach(row)[0] / low) > needed.left * math.log(high / low)


def _scales(columns: Any, rows: list[Row], low: float, high: float) -> None:
    first, noise, disk = columns
    first.set_xscale("log")
    first.set_xlim(low, high)
    ticks = [t for t in (1, 2, 3, 5, 10, 20, 30, 50, 100, 200, 500) if low <= t <= max(_reach(row)[1] for row in rows)]
    first.set_xticks(ticks, [str(t) for t in ticks])
    first.minorticks_off()
    noise.set_xscale("log")
    most = max(row.disk_margin for row in rows)
    disk.set_xlim(-0.06 * most, 1.1 * most)  # a margin of nothing is a whole dot too
    reference = next(row for row in rows if row.key == "hinf")
    for axes, value in ((noise, reference.noise_rms), (disk, reference.disk_margin)):
        axes.axvline(value, color=COLOURS["on"], linewidth=0.8, linestyle=(0, (3, 2)), zorder=0)
    noise.margins(x=0.12)


def _legend(axes: Axes) -> None:
    axes.plot([], [], color=MUTED, linestyle="none", label="as designed", **_DOT)
    for name, mark in _MARKS.items():
        axes.plot([], [], color=MUTED, label=name, **mark)
    axes.legend(
        loc="upper left", bbox_to_anchor=(-0.45, -0.09), ncols=5, frameon=False, fontsize=8, columnspacing=1.4,
        handletextpad=0.2, borderaxespad=0.0, labelcolor=MUTED,
    )  # fmt: skip

"""A Chart as inline SVG, by matplotlib, and as JSON for the page's own zoom.

Text stays text (searchable, in the page's font); the layout is computed here rather than by matplotlib, so that
`page.js` knows where every axis is. The same chart gives the same bytes.
"""

import base64
import io
import json
import re
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import (
    FixedFormatter,
    FixedLocator,
    FuncFormatter,
    LogLocator,
    MaxNLocator,
    MultipleLocator,
    NullLocator,
)

from dob_companion.report.chart import Array, Chart, Curve, Mark, Panel, Scale, envelope
from dob_companion.report.palette import COLOURS, INK, MUTED, PAPER, RULE

_LEFT, _RIGHT, _TOP, _BOTTOM = 48.0, 12.0, 46.0, 40.0
_LEFT_OF_NAMES = 84.0
_COL_GAP, _ROW_GAP = 44.0, 30.0
_FONT = 11.5
_X_TICKS, _Y_TICKS, _STEPS = 8, 5, [1, 2, 2.5, 5, 10]
_TICK, _DIGIT = 8.0, 7.3
"""Pixels that a tick with its space takes, and a digit of its number at this size (DejaVu Sans, the widest)."""


_CLEAR: dict[str, Any] = {"facecolor": PAPER, "alpha": 0.8, "edgecolor": "none", "pad": 1.0}
"""Behind a word among curves."""

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "text.parse_math": False,  # a name with a dollar sign is a name
    "font.family": "DejaVu Sans",  # ships with matplotlib: the same metrics on every machine
    "font.size": _FONT,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.8,
    "axes.unicode_minus": True,
    "grid.color": RULE,
    "grid.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "xtick.minor.size": 0.0,
    "path.simplify": True,
    "lines.solid_joinstyle": "round",
}


def svg(chart: Chart) -> str:
    """The chart as one `<svg>` element whose ids all begin with the chart's key."""
    with mpl.rc_context(_STYLE | {"svg.hashsalt": chart.key}):
        figure = Figure(figsize=(chart.width / 72.0, chart.height / 72.0), dpi=72)
        FigureCanvasSVG(figure)
        for index, panel in enumerate(chart.panels):
            x, y, w, h = box(chart, panel)
            place = (x / chart.width, 1.0 - (y + h) / chart.height, w / chart.width, h / chart.height)
            axes = figure.add_axes(place, gid=f"axes{index}")
            _draw_panel(axes, panel, f"p{index}-", columns=int(w), bottom=_is_bottom(chart, panel))
        _legend(figure, chart)
        out = io.StringIO()
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(out, format="svg", metadata=nothing, transparent=True)
    return _inline(out.getvalue(), chart)


def standalone(chart: Chart) -> str:
    """The chart as an SVG file that shows by itself."""
    return alone(svg(chart))


def alone(element: str) -> str:
    """An SVG file of an `<svg>` element that `svg` made: own size, white ground."""
    ground = f'<rect width="100%" height="100%" fill="{PAPER}"/>'
    head, body = element.split(">", 1)
    sized = re.sub(r'viewBox="0 0 (\S+) (\S+)"', r'width="\1" height="\2" \g<0>', head, count=1)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{sized}>{ground}{body}\n'


def data(chart: Chart) -> str:
    """The chart as JSON: arrays are base64 of little-endian float32, an array used twice is stored once."""
    xs: list[Array] = []
    panels = [_panel_object(chart, panel, xs) for panel in chart.panels]
    obj = {"width": chart.width, "height": chart.height, "panels": panels, "xs": [_packed(x) for x in xs]}
    # "<" would let a hostile name close the script element that holds this
    return json.dumps(obj, sort_keys=True, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def box(chart: Chart, panel: Panel) -> tuple[float, float, float, float]:
    """Left, top, width and height of a panel's axes in the SVG's pixels, y downwards."""
    left, gap = _room_for_ticks(chart)
    x, w = _share(chart.width - left - _RIGHT, chart.col_widths, panel.col, gap)
    y, h = _share(chart.height - _TOP - _BOTTOM, chart.row_heights, panel.row, _ROW_GAP)
    return round(left + x, 2), round(_TOP + y, 2), round(w, 2), round(h, 2)


def _room_for_ticks(chart: Chart) -> tuple[float, float]:
    """Left margin and gap between columns: as much as the numbers beside the y axes need, in pixels."""
    first = [_tick_width(panel.y) for panel in chart.panels if panel.col == 0]
    others = [_tick_width(panel.y) for panel in chart.panels if panel.col > 0]
    return max([_LEFT, *first]), max([_COL_GAP, *(width + _RIGHT for width in others)])


def _tick_width(scale: Scale) -> float:
    """How wide the widest number or name on a y axis is at most, its tick included."""
    if scale.names:
        return _LEFT_OF_NAMES
    if scale.log:
        return 0.0
    locator = MultipleLocator(scale.step) if scale.step else MaxNLocator(_Y_TICKS, steps=_STEPS)
    marks = [float(mark) for mark in locator.tick_values(scale.low, scale.high) if scale.low <= mark <= scale.high]
    step = min(np.diff(marks), default=1.0)
    places = next((n for n in range(9) if abs(round(step, n) - step) < 1e-6 * step), 9)
    return _TICK + _DIGIT * max((len(f"{mark:.{places}f}") for mark in marks), default=0)


def _share(total: float, weights: tuple[float, ...], index: int, gap: float) -> tuple[float, float]:
    unit = (total - gap * (len(weights) - 1)) / sum(weights)
    return sum(weights[:index]) * unit + gap * index, weights[index] * unit


def _is_bottom(chart: Chart, panel: Panel) -> bool:
    return panel.row == max(other.row for other in chart.panels if other.col == panel.col)


def _draw_panel(axes: Axes, panel: Panel, gid: str, columns: int, bottom: bool) -> None:
    _scales(axes, panel)
    axes.grid(True, zorder=0)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(
        f"{panel.title} · {panel.y.title}" if panel.title else panel.y.title, loc="left", y=1.0, pad=7, fontsize=_FONT
    )
    axes.tick_params(labelbottom=bottom)
    if bottom:
        axes.set_xlabel(panel.x.title, labelpad=4, color=MUTED)
    axes.xaxis.set_gid(gid + "x")
    axes.yaxis.set_gid(gid + "y")
    for i, band in enumerate(panel.bands):
        fill = axes.fill_between(band.x, band.low, band.high, color=COLOURS[band.role], alpha=0.18, linewidth=0)
        fill.set_gid(f"{gid}b{i}")
    for i, mark in enumerate(panel.marks):
        _draw_mark(axes, mark, f"{gid}m{i}")
    for i, curve in enumerate(panel.curves):
        as_is = curve.marker or curve.along is not None
        x, y = (curve.x, curve.y) if as_is else envelope(curve.x, curve.y, columns)
        axes.plot(x, y, gid=f"{gid}c{i}", **_line(curve))


def _draw_mark(axes: Axes, mark: Mark, gid: str) -> None:
    style: dict[str, Any] = {"color": MUTED, "linewidth": 0.9, "dashes": (2, 2), "gid": gid}
    if mark.x is not None:
        axes.axvline(mark.x, **style)
        place: dict[str, Any] = {"xy": (mark.x, 1.0), "xycoords": ("data", "axes fraction"), "va": "top"}
        behind = _CLEAR | {"gid": gid + "b"}
        spot: dict[str, Any] = {"xytext": (4, -3), "textcoords": "offset points"}
        axes.annotate(mark.label, color=MUTED, gid=gid + "t", bbox=behind, **spot, **place)
    if mark.y is not None:
        axes.axhline(mark.y, **style)


def _line(curve: Curve) -> dict[str, Any]:
    colour = COLOURS[curve.role]
    if curve.marker:
        face = "none" if curve.marker == "o" else colour
        return {
            "linestyle": "none",
            "marker": curve.marker,
            "markersize": 7,
            "markeredgewidth": 1.5,
            "markerfacecolor": face,
            "markeredgecolor": colour,
        }
    return {"color": colour, "linewidth": curve.width, "linestyle": (0, (5, 2.5)) if curve.dashed else "solid"}


def _scales(axes: Axes, panel: Panel) -> None:
    axes.set_xlim(panel.x.low, panel.x.high)
    axes.set_ylim(panel.y.low, panel.y.high)
    for axis, scale, count in ((axes.xaxis, panel.x, _X_TICKS), (axes.yaxis, panel.y, _Y_TICKS)):
        if scale.log:
            (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
            axis.set_major_locator(LogLocator(10.0, numticks=12))
            axis.set_minor_locator(NullLocator())
        elif scale.names:
            axis.set_major_locator(FixedLocator(range(len(scale.names))))
            axis.set_major_formatter(FixedFormatter(scale.names))
        elif scale.step:
            axis.set_major_locator(MultipleLocator(scale.step))
        else:
            axis.set_major_locator(MaxNLocator(count, steps=_STEPS))
        if scale.log:
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlim(panel.x.low, panel.x.high)
    axes.set_ylim(panel.y.low, panel.y.high)


def _legend(figure: Figure, chart: Chart) -> None:
    named: dict[str, Line2D] = {}
    curves = [curve for panel in chart.panels for curve in panel.curves if curve.name]
    for curve in sorted(curves, key=lambda c: c.role == "bound"):  # bounds lie under the rest and are named after them
        if curve.name not in named:
            named[curve.name] = Line2D([], [], **_line(curve))
    for panel in chart.panels:
        for band in panel.bands:
            named.setdefault(band.name, Line2D([], [], color=COLOURS[band.role], alpha=0.18, linewidth=8))
    figure.legend(
        list(named.values()),
        list(named),
        loc="upper left",
        bbox_to_anchor=((_room_for_ticks(chart)[0] - 4) / chart.width, 1.0 - 1.0 / chart.height),
        ncols=len(named),
        frameon=False,
        borderaxespad=0.0,
        handlelength=1.8,
        handletextpad=0.6,
        columnspacing=1.6,
    )


def _inline(text: str, chart: Chart) -> str:
    text = text[text.index("<svg") :].strip()
    # In tags only, where numbers are pixels: a hundredth is enough.
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(?<=\d\.\d\d)\d+", "", tag[0]), text)
    text = re.sub(r">([^<>]+)</text>", lambda node: f">{_subscripts(node[1])}</text>", text)
    text = re.sub(r'\bid="', f'id="{chart.key}-', text)
    text = re.sub(r'href="#', f'href="#{chart.key}-', text)
    text = text.replace("url(#", f"url(#{chart.key}-")
    head = f'<svg viewBox="0 0 {chart.width} {chart.height}" role="img" xmlns:xlink="http://www.w3.org/1999/xlink"'
    return re.sub(r"^<svg[^>]*", f'{head} xmlns="http://www.w3.org/2000/svg"', text, count=1)


def _subscripts(text: str) -> str:
    """`W_d` as W with a lowered d: two shifts, since not every browser knows baseline-shift."""
    lowered = r'\1<tspan dy="3" style="font-size: 80%">\2</tspan><tspan dy="-3">&#8203;</tspan>'
    return re.sub(r"\b([A-Za-z])_([a-z])\b", lowered, text)


def _panel_object(chart: Chart, panel: Panel, xs: list[Array]) -> dict[str, Any]:
    def shared(x: Array) -> int:
        for i, known in enumerate(xs):
            if known is x or np.array_equal(known, x):
                return i
        xs.append(x)
        return len(xs) - 1

    curves = [
        {
            "name": c.name,
            "colour": COLOURS[c.role],
            "dashed": c.dashed,
            "marker": c.marker,
            "width": c.width,
            "x": shared(c.x),
            "y": _packed(c.y),
            "along": None if c.along is None else _packed(c.along),
        }
        for c in panel.curves
    ]
    bands = [
        {"colour": COLOURS[b.role], "x": shared(b.x), "low": _packed(b.low), "high": _packed(b.high)}
        for b in panel.bands
    ]
    return {
        "box": box(chart, panel),
        "col": panel.col,
        "bottom": _is_bottom(chart, panel),
        "title": panel.title,
        "x": {"unit": panel.x.unit, "label": panel.x.label, "lim": [panel.x.low, panel.x.high], "log": panel.x.log},
        "y": {
            "unit": panel.y.unit,
            "label": panel.y.label,
            "lim": [panel.y.low, panel.y.high],
            "log": panel.y.log,
            "names": panel.y.names,
        },
        "curves": curves,
        "bands": bands,
        "marks": [{"x": m.x, "y": m.y, "label": m.label} for m in panel.marks],
    }


def _packed(values: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")

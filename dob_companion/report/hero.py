"""The picture of a flight for a README: three axes, observer off, then on, the ratios beside them."""

import io
from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from dob_companion.artifact import AXES
from dob_companion.report.chart import envelope, symmetric
from dob_companion.report.flight_charts import still_air, switch_time
from dob_companion.report.palette import COLOURS, INK, MUTED, PAPER, RULE
from dob_companion.report.trace import FlightTrace
from dob_companion.report.words import number

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.6,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "lines.solid_joinstyle": "round",
}
_SIZE_IN, _DPI = (8.0, 4.5), 200
_COLUMNS = 1200


def hero_png(trace: FlightTrace, result: Mapping[str, Any]) -> bytes:
    """A PNG of 1600 x 900 pixels: attitude error over both windows, the switch marked, RMS ratios from result.json."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=_SIZE_IN, dpi=_DPI, facecolor=PAPER)
        FigureCanvasAgg(figure)
        rows = figure.subplots(
            3, 1, sharex=True, gridspec_kw={"left": 0.075, "right": 0.865, "top": 0.80, "bottom": 0.10, "hspace": 0.28}
        )
        for i, (axes, axis) in enumerate(zip(rows, AXES, strict=True)):
            _draw_axis(axes, trace, i)
            _ratio(axes, axis, result["axes"][axis])
        rows[-1].set_xlabel("time, s", color=MUTED)
        _words(figure, rows[0], trace, result)
        drawn = io.BytesIO()
        figure.savefig(drawn, format="png", dpi=_DPI, metadata={"Software": None})
    picture = Image.open(drawn).convert("RGB")
    # A hundred colours are all that a line drawing has, and a third of the bytes.
    out = io.BytesIO()
    picture.quantize(96, dither=Image.Dither.NONE).save(out, format="PNG", optimize=True)
    return out.getvalue()


def _draw_axis(axes: Axes, trace: FlightTrace, i: int) -> None:
    off, on = trace.rows("off"), trace.rows("on")
    time, error = trace.seconds(), trace.attitude_error[:, i]
    pieces = ((off, "off"), (slice(off.stop - 1, on.start + 1), "bound"), (on, "on"))
    for rows, role in pieces:
        axes.plot(*envelope(time[rows], error[rows], _COLUMNS), color=COLOURS[role], linewidth=1.0)
    pause = still_air(trace)
    if pause:
        axes.axvspan(*pause, color=COLOURS["bound"], alpha=0.16, linewidth=0)
    limit = symmetric([error[off.start : on.stop]])
    axes.set(xlim=(0.0, time[on.stop - 1]), ylim=(-limit, limit))
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines["bottom"].set_visible(i == len(AXES) - 1)
    axes.tick_params(length=2.5 if i == len(AXES) - 1 else 0.0)
    axes.locator_params(axis="y", nbins=4)
    axes.axhline(0.0, color=RULE, linewidth=0.6, zorder=0)
    axes.axvline(switch_time(trace), color=INK, linewidth=0.8, linestyle=(0, (3, 2)))


def _ratio(axes: Axes, axis: str, numbers: Mapping[str, float]) -> None:
    at: dict[str, Any] = {"transform": axes.transAxes, "va": "center"}
    axes.text(1.025, 0.80, axis, color=MUTED, fontsize=9.5, **at)
    axes.text(
        1.025, 0.48, f"÷ {number(numbers['rms_ratio'], 2)}", color=COLOURS["on"], fontsize=19, weight="bold", **at
    )
    axes.text(1.025, 0.17, "RMS, off / on", color=MUTED, fontsize=7.5, **at)


def _words(figure: Figure, top: Axes, trace: FlightTrace, result: Mapping[str, Any]) -> None:
    what = "under gusts" if result["scenario"] == "paper" else f"of scenario {result['scenario']}"
    head = f"Attitude error in hover, one flight {what}"
    figure.text(0.075, 0.93, head, fontsize=14, weight="bold", va="center")
    figure.text(0.075, 0.872, "rad; simulated tail-sitter, MAVLink over UDP", fontsize=9, color=MUTED, va="center")
    off, on = trace.rows("off"), trace.rows("on")
    time = trace.seconds()
    pause = still_air(trace)
    if pause:
        spot: dict[str, Any] = {"xy": (sum(pause) / 2.0, 0.93), "xycoords": ("data", "axes fraction"), "ha": "center"}
        top.annotate("still air", color=MUTED, fontsize=8, va="top", **spot)
    top.annotate("switched on", (switch_time(trace), 1.06), xycoords=("data", "axes fraction"), fontsize=8, ha="center")
    for rows, role in ((off, "off"), (on, "on")):
        middle = (time[rows.start] + time[rows.stop - 1]) / 2.0
        place: dict[str, Any] = {"xy": (middle, 1.06), "xycoords": ("data", "axes fraction"), "ha": "center"}
        top.annotate(f"observer {role}", color=COLOURS[role], weight="bold", fontsize=10, **place)

"""Figures of a campaign as inline SVG, by matplotlib; the same rows give the same bytes."""

import io
import re
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from sitl.campaign.pilot import Row
from sitl.constants import AXES

COLOURS = ("#0072b2", "#d55e00", "#8a4f7d", "#e69f00", "#2b2b2b", "#5a9e6f")
"""Told apart by any eye: Okabe and Ito's set, purple and green darkened."""

INK, MUTED, RULE = "#2b2b2b", "#666666", "#e4e4e4"

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "campaign",
    "text.parse_math": False,
    "font.family": "DejaVu Sans",
    "font.size": 11.5,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": RULE,
    "grid.linewidth": 0.8,
    "text.color": INK,
    "axes.labelcolor": MUTED,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
}

Groups = list[tuple[str, list[Row]]]


def grouped(rows: Sequence[Row], names: Sequence[str]) -> Groups:
    """Rows by what was chosen, each group with its name."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(", ".join(f"{name} {row[name]}" for name in names), []).append(row)
    return list(groups.items())


def distribution(groups: Groups, measure: str, title: str, share: str) -> str:
    """How a measure is spread, an axis a panel: cumulative curves of a few groups, bars of many."""
    few = len(groups) <= len(COLOURS)
    height = 300 if few else 90 + 20 * len(groups)
    with mpl.rc_context(_STYLE):
        figure, panels = _panels(height)
        for axes, axis in zip(panels, AXES, strict=True):
            samples = [_numbers(rows, f"{measure}_{axis}") for _, rows in groups]
            if few:
                _curves(axes, groups, samples)
            else:
                _bars(axes, groups, samples, axis == AXES[0])
            axes.set_title(axis, loc="left", fontsize=11.5)
        panels[1].set_xlabel(title)
        if few:
            panels[0].set_ylabel(share)
            _legend(figure, panels[0], groups)
        return _svg(figure, f"{title}, by axis")


def scatter(groups: Groups, name: str, title: str) -> str:
    """RMS off/on over what was drawn for each seed, an axis a panel."""
    with mpl.rc_context(_STYLE):
        figure, panels = _panels(300)
        for axes, axis in zip(panels, AXES, strict=True):
            for i, (label, rows) in enumerate(groups):
                key = f"rms_ratio_{axis}"
                shown = [row for row in rows if row[key] is not None]
                x, y = [row[name] for row in shown], [row[key] for row in shown]
                axes.plot(x, y, "o", ms=4.5, mew=0, alpha=0.7, color=COLOURS[i % len(COLOURS)], label=label)
            axes.set_title(axis, loc="left", fontsize=11.5)
        panels[0].set_ylim(bottom=0.0)
        panels[0].set_ylabel("RMS off / on")
        panels[1].set_xlabel(title)
        if len(groups) <= len(COLOURS):
            _legend(figure, panels[0], groups)
        return _svg(figure, f"RMS off / on over {title}, by axis")


def _numbers(rows: list[Row], column: str) -> np.ndarray:
    return np.sort([row[column] for row in rows if row[column] is not None])


def _panels(height: float) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(1100 / 72, height / 72), dpi=72, layout="constrained")
    FigureCanvasSVG(figure)
    return figure, list(figure.subplots(1, 3, sharey=True))


def _curves(axes: Axes, groups: Groups, samples: list[np.ndarray]) -> None:
    for i, ((label, _), x) in enumerate(zip(groups, samples, strict=True)):
        if len(x):
            axes.ecdf(x, color=COLOURS[i], lw=1.6, label=label)
    axes.set_ylim(0.0, 1.0)


def _bars(axes: Axes, groups: Groups, samples: list[np.ndarray], named: bool) -> None:
    """5 to 95 % thin, quartiles thick, the median a dot."""
    for i, x in enumerate(samples):
        if not len(x):
            continue
        p5, p25, median, p75, p95 = np.percentile(x, (5, 25, 50, 75, 95))
        axes.plot((p5, p95), (i, i), color=COLOURS[0], lw=1.0)
        axes.plot((p25, p75), (i, i), color=COLOURS[0], lw=4.0, solid_capstyle="butt")
        axes.plot(median, i, "o", color=INK, ms=4.0)
    axes.set_ylim(len(groups) - 0.5, -0.5)
    if named:
        axes.set_yticks(range(len(groups)), [label for label, _ in groups])


def _legend(figure: Figure, axes: Axes, groups: Groups) -> None:
    if len(groups) > 1:
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False)


def _svg(figure: Figure, alt: str) -> str:
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")), transparent=True)
    element = out.getvalue()
    element = element[element.index("<svg") :]
    element = re.sub(r' (width|height)="[\d.]+pt"', "", element, count=2)
    return element.replace("<svg", f'<svg role="img" aria-label="{alt}"', 1)

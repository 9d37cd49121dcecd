"""The trade-off that `design --auto` chose from: attenuation against disk margin and against noise."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dob_companion.report.chart import Chart, Curve, Mark, Panel, Scale
from dob_companion.report.page import PageFigure, figure
from dob_companion.report.words import listed, number
from dob_companion.synthesis.tune.limits import Tuning
from dob_companion.synthesis.tune.yardstick import Measured


def tradeoff_figures(key: str, tuning: Tuning) -> list[PageFigure]:
    """The figure `tradeoff` of one block, with what limits the choice in words."""
    limits = listed(tuning.limited_by) if tuning.limited_by else "no limit that was asked for"
    crosses = "Grey crosses are bounds: no observer of any order attenuates more. " if tuning.limit else ""
    caption = (
        "Attenuation is the RMS attitude error with the observer off over that with it on, for "
        f"{tuning.auto.disturbances}. {crosses}Blue points are the best for other limits. The choice, "
        f"{number(tuning.chosen.attenuation, 3)}, is held back by {limits}."
    )
    return [figure(tradeoff(f"{key}-tradeoff", tuning), "Trade-off.", caption)]


def tradeoff(key: str, tuning: Tuning) -> Chart:
    """Two panels over the same attenuation; dashed lines are the limits that [auto] sets."""
    found = [*(row.found for row in tuning.rows), tuning.chosen]
    best = max(m.attenuation for m in [*found, *_bounds(tuning)])
    y = Scale("attenuation, off / on", "", 0.3, 1.5 * best, log=True)
    margins = Scale("disk margin", "", 0.0, 1.05 * max(tuning.disk_margin_off, tuning.asked.disk_margin))
    noises = [m.noise for m in found] + [tuning.asked.noise]
    low, high = (float(10.0 ** edge(np.log10(end(noises)))) for edge, end in ((np.floor, min), (np.ceil, max)))
    noise = Scale("noise in the correction, RMS", "", low, high, log=True)
    panels = (
        Panel(
            0,
            0,
            margins,
            y,
            _points(tuning, lambda m: m.disk_margin),
            marks=(Mark(x=tuning.asked.disk_margin, label="asked"),),
        ),
        Panel(
            0,
            1,
            noise,
            y,
            _points(tuning, lambda m: m.noise),
            marks=(Mark(x=tuning.asked.noise, label="asked"),),
        ),
    )
    alt = "Attenuation against disk margin and against noise in the correction, the choice marked."
    return Chart(key, alt, panels, 860, 400, col_widths=(1.0, 1.0))


def _bounds(tuning: Tuning) -> list[Measured]:
    """Each row's observer and the chosen one, with the attenuation that none exceeds in the place of theirs."""
    pairs = [*((row.found, row.limit) for row in tuning.rows), (tuning.chosen, tuning.limit)]
    return [replace(found, attenuation=limit) for found, limit in pairs if limit]


def _points(tuning: Tuning, of: Callable[[Measured], float]) -> tuple[Curve, ...]:
    def curve(name: str, values: Sequence[Measured], role: str, marker: str) -> Curve:
        x, y = np.array([of(m) for m in values]), np.array([m.attenuation for m in values])
        return Curve(name, x, y, role, marker=marker)

    bounds = _bounds(tuning)
    curves = [curve("no observer exceeds", bounds, "bound", "x")] if bounds else []
    curves += [
        curve("best for other limits", [row.found for row in tuning.rows], "on", "o"),
        curve("chosen", [tuning.chosen], "off", "o"),
    ]
    if tuning.own:
        curves.append(curve("the spec's own weights", [tuning.own], "extra", "o"))
    return tuple(curves)

"""The paper's Fig. 6 for one axis: the measured response with its coherence, the fitted model, and (11) for pitch."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sitl.airframe.linear import PITCH
from sitl.sweep.estimate import Complexes
from sitl.sweep.fit import response_of
from sitl.sweep.identify import Identified
from sitl.sweep.multisine import Floats

MEASURED, MODEL, PAPER, INPUT = "#1f5fa8", "#c8501e", "#3d7d3d", "#888888"


def save_figure(one: Identified, path: Path, title: str = "") -> None:
    """Write the figure of one axis; the format is that of the file's suffix."""
    figure = Figure(figsize=(8.0, 7.0), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    magnitude, phase, coherence = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 1))
    figure.suptitle(title or f"Frequency sweep of the simulated vehicle, {one.axis}: u_e to y_n")
    response, w = one.response, one.response.frequency
    low, high = one.fit.band
    for axes in (magnitude, phase, coherence):
        axes.axvspan(low, high, color="#f2ede2", zorder=0)
        axes.grid(True, which="both", color="#e4e4e4", linewidth=0.5)
    model = response_of(one.fit.model, w)
    _bode(magnitude, phase, w, response.value, ".", MEASURED, "measured", model)
    error = response.deviation / np.abs(response.value)
    level = 20.0 * np.log10(np.abs(response.value))
    band = 20.0 * np.log10(1.0 + 2.0 * error)
    magnitude.fill_between(w, level - band, level + band, color=MEASURED, alpha=0.2, lw=0, label="± 2 deviations")
    _bode(magnitude, phase, w, model, "-", MODEL, f"fit, {low:g} to {high:g} rad/s")
    if one.axis == "pitch":
        _bode(magnitude, phase, w, response_of(PITCH, w), "--", PAPER, "paper, Eq. (11)", model)
    magnitude.set_ylabel("dB, (rad/s) per unit torque")
    magnitude.legend(loc="lower left", fontsize=8)
    phase.set_ylabel("degrees")
    coherence.semilogx(w, response.coherence_y, color=MEASURED, linewidth=1, label="injected to y_n")
    coherence.semilogx(w, response.coherence_u, color=INPUT, linewidth=1, label="injected to u_e")
    coherence.set_ylim(0.0, 1.05)
    coherence.set_ylabel("coherence")
    coherence.set_xlabel("rad/s")
    coherence.legend(loc="lower left", fontsize=8)
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def _bode(
    magnitude: Axes,
    phase: Axes,
    w: Floats,
    value: Complexes,
    style: str,
    colour: str,
    label: str,
    near: Complexes | None = None,
) -> None:
    """Magnitude and phase; the phase continues that of `near`, whose own is smooth."""
    near = value if near is None else near
    level = 20.0 * np.log10(np.abs(value))
    angle = np.degrees(np.unwrap(np.angle(near)) + np.angle(value / near))
    magnitude.semilogx(w, level, style, label=label, color=colour, markersize=3.0, linewidth=1.2)
    phase.semilogx(w, angle, style, color=colour, markersize=3.0, linewidth=1.2)

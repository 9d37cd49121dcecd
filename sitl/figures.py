"""The figure of a flight: attitude error off and on per axis, and the corrections. It alone needs matplotlib."""

import io
from typing import Any

import numpy as np

from sitl.constants import AXES, DT_US
from sitl.log import OFF_WINDOW, ON_WINDOW, Arrays
from sitl.scenario.spec import Scenario

OFF, ON = "#9a9a9a", "#0b5fa5"
COLOURS = ("#b5482a", "#0b5fa5", "#3c8d40")


def figure(scenario: Scenario, arrays: Arrays) -> bytes:
    """PNG of a flight with both windows. Raises ModuleNotFoundError when matplotlib is not there."""
    from matplotlib.figure import Figure

    sheet = Figure(figsize=(9.0, 9.0), layout="constrained")
    plots = sheet.subplots(4, 1, sharex=True)
    window = arrays["window"]
    off, on = (np.flatnonzero(window == number) for number in (OFF_WINDOW, ON_WINDOW))
    seconds = np.arange(len(on)) * DT_US * 1e-6
    for i, axis in enumerate(AXES):
        error = arrays["attitude_error"][:, i]
        plots[i].plot(seconds, error[off], color=OFF, linewidth=0.8, label="observer off")
        plots[i].plot(seconds, error[on], color=ON, linewidth=0.8, label="observer on")
        plots[i].set_ylabel(f"{axis} error, rad")
        plots[3].plot(seconds, arrays["correction"][on, i], color=COLOURS[i], linewidth=0.8, label=axis)
    plots[3].set_ylabel("correction")
    plots[3].set_xlabel("window time, s")
    for plot in plots:
        plot.grid(alpha=0.3)
    plots[0].legend(loc="upper right", ncols=2, fontsize="small")
    plots[3].legend(loc="upper right", ncols=3, fontsize="small")
    _mark_events(scenario, plots)
    sheet.suptitle(scenario.title)
    out = io.BytesIO()
    sheet.savefig(out, format="png", dpi=110, metadata={"Software": None})
    return out.getvalue()


def _mark_events(scenario: Scenario, plots: Any) -> None:
    for event in scenario.events:
        if event.label and event.at_s > 0.0:
            for plot in plots:
                plot.axvline(event.at_s, color="black", linewidth=0.6, linestyle=":")
            plots[0].annotate(
                event.label, (event.at_s, 0.98), xycoords=("data", "axes fraction"), va="top", fontsize="small"
            )

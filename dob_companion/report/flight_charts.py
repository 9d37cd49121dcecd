"""The paper's time-domain figures (11, 12, 13) and an overview, drawn from a recorded flight."""

import numpy as np

from dob_companion.artifact import AXES
from dob_companion.report.chart import Array, Band, Chart, Curve, Mark, Panel, Scale, symmetric
from dob_companion.report.trace import FlightTrace

_WIDTH = 1120
_ROWS = (1.0, 1.0, 1.0)
_ZOOM_S = 4.0


def overview(trace: FlightTrace, key: str = "overview") -> Chart:
    """The attitude error of the whole flight, both windows in their colours, the switch marked; `key` names it."""
    start, stop = trace.rows("off").start, trace.rows("on").stop
    whole, off, on = slice(start, stop), trace.rows("off"), trace.rows("on")
    between = slice(off.stop - 1, on.start + 1)
    time = trace.seconds()
    panels = []
    for i, axis in enumerate(AXES):
        error = trace.attitude_error[:, i]
        limit = symmetric([error[whole]])
        curves = (
            Curve("observer off", time[off], error[off], "off", width=1.2),
            Curve("between the windows", time[between], error[between], "bound", width=1.2),
            Curve("observer on", time[on], error[on], "on", width=1.2),
        )
        x = Scale("time", "s", 0.0, _end(time[whole]))
        mark = Mark(x=switch_time(trace), label="switched on" if i == 0 else "")
        panels.append(Panel(i, 0, x, _error_scale(limit), curves, _still_bands(trace, limit), (mark,), axis))
    alt = (
        "Attitude error of roll, pitch and yaw over the whole flight: large with the observer off, small once it is on."
    )
    return Chart(key, alt, tuple(panels), _WIDTH, 560, row_heights=_ROWS)


def switch_time(trace: FlightTrace) -> float:
    """When the first correction that is not zero acts, s since the off window began; the on window if none does."""
    after = trace.rows("off").stop
    moved = np.flatnonzero(np.any(trace.correction[after:] != 0.0, axis=1))
    index = after + int(moved[0]) if moved.size else trace.rows("on").start
    return float(trace.seconds()[index])


def still_air(trace: FlightTrace) -> tuple[float, float] | None:
    """When the disturbance pauses between the windows, s since the off window began; None if it never does, and where
    there is none in the windows either (wind, loads and faults are not in it)."""
    rows = slice(trace.rows("off").stop, trace.rows("on").start)
    if not np.any(trace.disturbance[trace.rows("off")]):
        return None
    still = np.flatnonzero(np.all(trace.disturbance[rows] == 0.0, axis=1))
    if still.size < 2:
        return None
    time = trace.seconds()[rows]
    return float(time[still[0]]), float(time[still[-1]])


def _still_bands(trace: FlightTrace, limit: float) -> tuple[Band, ...]:
    ends = still_air(trace)
    if ends is None:
        return ()
    return (Band("still air", np.array(ends), np.full(2, -limit), np.full(2, limit), "bound"),)


def figure_11(trace: FlightTrace) -> Chart:
    """Attitude errors with the observer off."""
    errors, time = window_error(trace, "off"), trace.seconds(trace.rows("off"))
    panels = tuple(
        _error_panel(i, 0, axis, time, errors[:, i], "off", symmetric([errors[:, i]])) for i, axis in enumerate(AXES)
    )
    return Chart("fig11", "Attitude errors with the observer off, three axes.", panels, _WIDTH, 520, row_heights=_ROWS)


def figure_12(trace: FlightTrace) -> Chart:
    """Attitude errors with the observer on: at the scale of figure 11, and at their own."""
    errors, time = window_error(trace, "on"), trace.seconds(trace.rows("on"))
    before = window_error(trace, "off")
    panels = []
    for i, axis in enumerate(AXES):
        wide, near = symmetric([before[:, i], errors[:, i]]), symmetric([errors[:, i]])
        panels.append(_error_panel(i, 0, f"{axis}, scale of off", time, errors[:, i], "on", wide))
        panels.append(_error_panel(i, 1, f"{axis}, enlarged", time, errors[:, i], "on", near))
    alt = "Attitude errors with the observer on, three axes, at the scale of figure 11 and enlarged."
    return Chart("fig12", alt, tuple(panels), _WIDTH, 520, row_heights=_ROWS, col_widths=(1.0, 1.0))


def figure_13(trace: FlightTrace) -> Chart:
    """The disturbance and the estimate that the vehicle applied (-correction), whole window and a few seconds."""
    rows = trace.rows("on")
    time, d, d_hat = trace.seconds(rows), trace.disturbance[rows], -trace.correction[rows]
    middle = np.floor(_end(time) / 2.0)
    ends = (max(0.0, middle - _ZOOM_S / 2.0), min(_end(time), middle + _ZOOM_S / 2.0))
    panels = []
    for i, axis in enumerate(AXES):
        limit = symmetric([d[:, i], d_hat[:, i]])
        for col, (low, high) in enumerate(((0.0, _end(time)), ends)):
            kept = (time >= low) & (time <= high)
            curves = (
                Curve("disturbance d", time[kept], d[kept, i], "truth", width=3.0 if col else 2.0),
                Curve("estimate d̂ as applied", time[kept], d_hat[kept, i], "on", width=1.2 if col else 0.8),
            )
            y = Scale("moment", "normalized", -limit, limit)
            title = f"{axis}, {high - low:.0f} s of it" if col else axis
            panels.append(Panel(i, col, Scale("time in the window", "s", low, high), y, curves, title=title))
    alt = "Disturbance and its estimate on three axes; the estimate follows closely."
    return Chart("fig13", alt, tuple(panels), _WIDTH, 560, row_heights=_ROWS, col_widths=(1.9, 1.0))


def window_error(trace: FlightTrace, window: str) -> Array:
    """Attitude error (N, 3) of a window, rad, the mean of each axis removed as in result.json."""
    error = trace.attitude_error[trace.rows(window)]
    centred: Array = error - error.mean(axis=0)
    return centred


def _error_panel(row: int, col: int, title: str, time: Array, error: Array, role: str, limit: float) -> Panel:
    x = Scale("time in the window", "s", 0.0, _end(time))
    curve = Curve(f"observer {role}", time, error, role, width=1.2)
    return Panel(row, col, x, _error_scale(limit), (curve,), title=title)


def _error_scale(limit: float) -> Scale:
    return Scale("attitude error", "rad", -limit, limit)


def _end(time: Array) -> float:
    """Where the axis of a time trace ends: its last sample, up to a whole tenth of a second."""
    return float(np.ceil(time[-1] * 10.0) / 10.0)

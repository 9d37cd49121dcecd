"""The paper's frequency-domain figures (6 to 10), one column per axis, from the responses of synthesis.

A coupled block shows the diagonal of each response: axis to itself.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dob_companion.analysis.design import AxisResponses
from dob_companion.report.chart import Array, Chart, Curve, Mark, Panel, Scale, rounded

Complex = NDArray[np.complex128]
_DEEPEST_DB = 120.0  # below the highest curve; a null would otherwise flatten all else
_BEYOND_DB = 20.0  # how far a bound or a weight may widen the scale of the curves that it goes with


def figure_6(key: str, axes: Sequence[AxisResponses]) -> Chart:
    """The plant, magnitude and phase, with both weights over the magnitude."""
    magnitude, phase = [], []
    for a in axes:
        magnitude.append(
            (
                _db(a, "plant G", a.own(a.of.G), "truth", width=3.0),
                _db(a, "W_d", a.own(a.of.disturbance_weight), "weight", dashed=True),
                _db(a, "W_n", a.own(a.of.noise_weight), "bound", dashed=True),
            )
        )
        phase.append((_degrees(a, "plant G", a.own(a.of.G), "truth", width=3.0),))
    return _bode(key, "Bode diagram of the plant and the weights.", axes, magnitude, phase)


def figure_7(key: str, axes: Sequence[AxisResponses]) -> Chart:
    """Q, and the observer's plant inverse against the true one."""
    magnitude, phase = [], []
    for a in axes:
        parts = (
            ("G⁻¹ (plant)", a.own(a.of.G_inverse), "truth", 3.4),
            ("Gₙ⁻¹ (observer)", a.own(a.of.G_n_inverse), "on", 1.6),
            ("Q", a.own(a.of.Q), "extra", 1.6),
        )
        magnitude.append(tuple(_db(a, name, value, role, width=w) for name, value, role, w in parts))
        phase.append(tuple(_degrees(a, name, value, role, width=w) for name, value, role, w in parts))
    alt = "Bode diagram of Q, of the observer's inverse model and of the inverse plant."
    return _bode(key, alt, axes, magnitude, phase)


def figure_8(key: str, axes: Sequence[AxisResponses]) -> Chart:
    """Disturbance to its estimate; below, the error that is left and the level that gamma allows it."""
    magnitude, phase, errors = [], [], []
    for a in axes:
        estimate, left = a.own(a.of.d_to_estimate), a.own(a.of.error)
        magnitude.append((_db(a, "d → d̂", estimate, "on"),))
        phase.append((_degrees(a, "d → d̂", estimate, "on"),))
        allowed = a.gamma / np.abs(a.own(a.of.disturbance_weight))
        errors.append(
            (_db(a, "γ / |W_d|", allowed.astype(complex), "bound", width=4.0), _db(a, "d → d − d̂ delayed", left, "on"))
        )
    alt = "Bode diagram from the disturbance to its estimate, and the estimation error below its bound."
    return _bode(key, alt, axes, magnitude, phase, errors, error_title="error")


def figure_9(key: str, axes: Sequence[AxisResponses]) -> Chart:
    """Disturbance to body rate, observer off and on."""
    magnitude = [
        (
            _db(a, "observer off", a.own(a.of.d_to_rate_off), "off"),
            _db(a, "observer on", a.own(a.of.d_to_rate_on), "on"),
        )
        for a in axes
    ]
    alt = "Magnitude from the disturbance to the body rate, lower at low frequency with the observer on."
    return _bode(key, alt, axes, magnitude)


def figure_10(key: str, axes: Sequence[AxisResponses]) -> Chart:
    """Measurement noise to the estimate, and the level that gamma allows it."""
    magnitude = [
        (
            _db(a, "γ / |W_n|", (a.gamma / np.abs(a.own(a.of.noise_weight))).astype(complex), "bound", width=4.0),
            _db(a, "n → d̂", a.own(a.of.n_to_estimate), "on"),
        )
        for a in axes
    ]
    alt = "Magnitude from the measurement noise to the disturbance estimate, below its bound."
    return _bode(key, alt, axes, magnitude)


_Rows = Sequence[tuple[Curve, ...]]
_GUIDES = ("weight", "bound")


def _bode(
    key: str,
    alt: str,
    axes: Sequence[AxisResponses],
    magnitude: _Rows,
    phase: _Rows = (),
    errors: _Rows = (),
    error_title: str = "",
) -> Chart:
    """Rows magnitude, phase and error as far as given; a column per axis; one scale per row."""
    rows = [("magnitude", "dB", 20.0, 1.3, magnitude)]
    rows += [("phase", "°", 90.0, 1.0, phase)] if phase else []
    rows += [(error_title, "dB", 20.0, 1.0, errors)] if errors else []
    panels = []
    for r, (label, unit, step, _, columns) in enumerate(rows):
        low, high = _limits(columns, step)
        # Few enough ticks for the room there is.
        tick = step * max(1.0, np.ceil((high - low) / (7.0 * step)))
        marks = (Mark(y=0.0),) if unit == "dB" and low < 0.0 < high else ()
        for c, curves in enumerate(columns):
            hertz = axes[c].of.frequency_hz
            x = Scale("frequency", "Hz", float(hertz[0]), float(hertz[-1]), log=True)
            title = axes[c].axis if len(axes) > 1 else ""
            panels.append(Panel(r, c, x, Scale(label, unit, low, high, step=float(tick)), curves, (), marks, title))
    height = {1: 285, 2: 460, 3: 600}[len(rows)]
    return Chart(
        key=key,
        alt=alt,
        panels=tuple(panels),
        width=560 if len(axes) == 1 else 1120,
        height=height,
        row_heights=tuple(row[3] for row in rows),
        col_widths=(1.0,) * len(axes),
    )


def _limits(columns: _Rows, step: float) -> tuple[float, float]:
    every = [curve for curves in columns for curve in curves]
    low, high = rounded([c.y for c in every if c.role not in _GUIDES], step)
    if step != 20.0:
        return low, high
    wide_low, wide_high = rounded([c.y for c in every], step)
    high = min(wide_high, high + _BEYOND_DB)
    return max(wide_low, low - _BEYOND_DB, high - _DEEPEST_DB), high


def _db(a: AxisResponses, name: str, value: Complex, role: str, width: float = 1.6, dashed: bool = False) -> Curve:
    with np.errstate(divide="ignore"):
        level: Array = 20.0 * np.log10(np.abs(value))
    return Curve(name, a.of.frequency_hz, np.where(np.isfinite(level), level, np.nan), role, dashed, width=width)


def _degrees(a: AxisResponses, name: str, value: Complex, role: str, width: float = 1.6) -> Curve:
    return Curve(name, a.of.frequency_hz, np.degrees(np.unwrap(np.angle(value))), role, width=width)

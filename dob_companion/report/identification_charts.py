"""An axis as it was identified: the paper's Fig. 6 for this aircraft, with its bands and what speaks for it."""

import numpy as np
from numpy.typing import NDArray

from dob_companion.identification.result import AxisModel, Response
from dob_companion.report.chart import Array, Band, Chart, Curve, Mark, Panel, Scale, rounded

_SMALLEST = 1e-4


def response_chart(key: str, response: Response, model: AxisModel | None) -> Chart:
    """Magnitude and phase with their 95 % bands, the model over them, -1/C; below, coherences."""
    hertz = response.frequency / (2.0 * np.pi)
    x = Scale("frequency", "Hz", float(hertz[0]), float(hertz[-1]), log=True)
    level, phase = _level(response.value), _phase(response.value)
    size = np.abs(response.value)
    low, high = (_level(np.maximum(size + sign * response.band, _SMALLEST * size)) for sign in (-1.0, 1.0))
    turn = np.degrees(np.arcsin(np.minimum(response.band / size, 1.0)))
    magnitudes = [Curve("measured", hertz, level, "on")]
    phases = [Curve("measured", hertz, phase, "on")]
    if model is not None:
        fitted = model.response(response.frequency, response.rate_hz)
        magnitudes.append(Curve("model", hertz, _level(fitted), "off", dashed=True))
        phases.append(Curve("model", hertz, _near(_phase(fitted), phase), "off", dashed=True))
    if response.inverse_controller is not None:
        magnitudes.append(Curve("−1/C", hertz, _level(response.inverse_controller), "bound"))
        phases.append(Curve("−1/C", hertz, _near(_phase(response.inverse_controller), phase), "bound"))
    panels = (
        Panel(
            0,
            0,
            x,
            _decibels(magnitudes),
            tuple(magnitudes),
            (Band("95 %", hertz, np.maximum(low, level - 40.0), high, "on"),),
        ),
        Panel(
            1,
            0,
            x,
            Scale("phase", "°", *rounded([c.y for c in phases[:2]], 90.0), step=90.0),
            tuple(phases),
            (Band("95 %", hertz, phase - turn, phase + turn, "on"),),
        ),
        Panel(
            2,
            0,
            x,
            Scale("coherence", "", 0.0, 1.05, step=0.5),
            (
                Curve("with torque", hertz, response.coherence_u, "truth", width=3.0),
                Curve("with rate", hertz, response.coherence_y, "extra"),
            ),
        ),
    )
    alt = "Bode diagram of the measured response with its confidence band, the model fitted to it, and coherences."
    return Chart(key, alt, panels, 860, 560, row_heights=(1.4, 1.0, 0.6))


def misfit_chart(key: str, response: Response, model: AxisModel) -> Chart:
    """How far the measured response is from the model, with the bound that a design takes."""
    hertz = response.frequency / (2.0 * np.pi)
    fitted = model.response(response.frequency, response.rate_hz)
    apart = np.abs(response.value / fitted - 1.0)
    ends = np.array(model.bound.frequency_hz)
    last = max(float(hertz[-1]), float(ends[-1]), 0.4 * response.rate_hz)
    over = np.geomspace(float(hertz[0]), last, 200)
    bound = model.bound.at(over)
    highest = float(np.ceil(10.0 * max(1.0, min(float(np.max(bound)), 2.0))) / 10.0)
    curves = (
        Curve("|Ĝ/G − 1|, measured", hertz, np.minimum(apart, highest), "on"),
        Curve("95 % of noise", hertz, np.minimum(response.band / np.abs(fitted), highest), "bound"),
        Curve("bound for the design", over, np.minimum(bound, highest), "off", dashed=True),
    )
    marks = tuple(
        Mark(x=edge, label=word) for edge, word in zip(model.bound.band_hz, ("from", "measured to"), strict=True)
    )
    x = Scale("frequency", "Hz", float(over[0]), last, log=True)
    panel = Panel(0, 0, x, Scale("share of the model", "", 0.0, highest), curves, marks=marks)
    alt = "Distance of the measured response from the model, below the bound that the design is made for."
    return Chart(key, alt, (panel,), 860, 280)


def _level(values: NDArray[np.complex128] | Array) -> Array:
    return np.asarray(20.0 * np.log10(np.maximum(np.abs(values), 1e-12)))


def _phase(values: NDArray[np.complex128]) -> Array:
    return np.asarray(np.degrees(np.unwrap(np.angle(values))))


def _near(phase: Array, other: Array) -> Array:
    """The same phase by whole turns nearer to another."""
    return np.asarray(phase - 360.0 * np.round(np.median(phase - other) / 360.0))


def _decibels(curves: list[Curve]) -> Scale:
    low, high = rounded([curve.y for curve in curves if curve.role != "bound"], 20.0)
    return Scale("magnitude", "dB", low, high, step=20.0)

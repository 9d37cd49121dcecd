"""Figure 6: the vehicle's pitch dynamics from a frequency sweep, through MAVLink, of the nonlinear tail-sitter."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dob_companion.report.chart import Array, Chart, Curve, Mark, Panel, Scale
from docs.paper.section import Number, Section
from sitl.airframe.linear import PITCH
from sitl.sweep import cli
from sitl.sweep.estimate import Response
from sitl.sweep.fit import BAND, fit_rate_axis, response_of
from sitl.sweep.identify import Identified, acceleration, modes

SHOWN_FROM_RAD_S = 2.0  # slower than that, twelve seconds of period hold too little
FLEXIBLE_RAD_S = (50.0, 600.0)
Curves = tuple[tuple[str, Array, np.ndarray, str, bool], ...]


def section(work: Path) -> Section:
    """Sweep twice, without and with flexible modes; files stay in `work`. Raises RuntimeError when a sweep fails."""
    rigid, flexible = _swept(work / "rigid"), _swept(work / "flexible", "--flexible")
    found, known = rigid.fit.model, rigid.fit.deviation
    inside = (rigid.response.frequency >= BAND[0]) & (rigid.response.frequency <= BAND[1])
    ratio = rigid.response.value[inside] / response_of(PITCH, rigid.response.frequency[inside])
    seen = [w for w, _ in modes(flexible) if FLEXIBLE_RAD_S[0] <= w <= FLEXIBLE_RAD_S[1]]
    return Section(
        "Figure 6",
        "identification in pitch",
        "A frequency sweep; “from 4 to 50 rad/s there is an integral mode”, “from 50 to 600 rad/s there are three "
        "flexible modes”. (11) was fitted to a simulator without them.",
        "The nonlinear tail-sitter in hover, excited over the link with the baseline loop closed "
        "([how](identification.md)); fitted over 4 to 50 rad/s. Its numbers were chosen so that its linearization in "
        "hover is (11); that the sweep finds (11) again tests the vehicle, the link and the estimator together.",
        (
            Number("gain", f"{PITCH.gain:g}", found.gain, f"± {known.gain:.2g}", 0.95 * PITCH.gain, 1.05 * PITCH.gain),
            Number("zero", f"{PITCH.zero:g}", found.zero, f"± {known.zero:.2g}", PITCH.zero - 0.1, PITCH.zero + 0.1),
            Number("pole", f"{PITCH.pole:g}", found.pole, f"± {known.pole:.2g}", 0.943, 0.9464),
            Number("acceleration per unit below the pole", f"{acceleration(PITCH):.0f} rad/s²", acceleration(found),
                   "rad/s²", 0.98 * acceleration(PITCH), 1.02 * acceleration(PITCH)),
            Number("largest difference from (11), 4…50 rad/s", "0", float(np.abs(20 * np.log10(np.abs(ratio))).max()),
                   "dB", high=0.3),
            Number("the same in phase", "0", float(np.abs(np.degrees(np.angle(ratio))).max()), "°", high=3.0),
            Number("flexible modes, 50…600 rad/s", "3", float(len(seen)), "", 3.0, 3.0),
        ),
        (_chart(rigid, flexible),),
        (
            f"The flexible modes lie at {', '.join(f'{w:.0f}' for w in seen)} rad/s; the paper's text gives no "
            "numbers for its three, so these are guesses within its range.",
            "The zero outside the unit circle is sampling: an integrator behind 70 ms of rotor lag, held for 4 ms, "
            "with half a millisecond of delay ([worked out](identification.md)).",
        ),
    )  # fmt: skip


def _swept(directory: Path, *options: str) -> Identified:
    if cli.main(["--airframe", "tailsitter", "--axis", "pitch", "-o", str(directory), *options]) != 0:
        raise RuntimeError(f"the sweep into {directory} failed")
    with np.load(directory / "pitch.npz") as file:
        names = ("frequency", "response", "deviation", "coherence_u", "coherence_y")
        response = Response(*(file[name] for name in names))
    return Identified("pitch", response, fit_rate_axis(response))


def _chart(rigid: Identified, flexible: Identified) -> Chart:
    w, measured = _shown(rigid)
    curves: Curves = (
        ("paper, (11)", w, response_of(PITCH, w), "truth", False),
        ("measured, with flexible modes", *_shown(flexible), "extra", False),
        ("measured", w, measured, "on", False),
        ("fit, 4…50 rad/s", w, response_of(rigid.fit.model, w), "off", True),
    )
    level = [_curve(c, 20.0 * np.log10(np.abs(c[2]))) for c in curves]
    phase = [_curve(c, _degrees(c[1], c[2])) for c in curves]
    panels = (_panel(0, w, "magnitude", "dB", 20.0, level), _panel(1, w, "phase", "°", 90.0, phase))
    return Chart("fig06", "Frequency response of the tail-sitter in pitch: measured, fitted, and the paper's (11).",
                 panels, 1120, 520, row_heights=(1.4, 1.0))  # fmt: skip


def _shown(one: Identified) -> tuple[Array, np.ndarray]:
    kept = one.response.frequency >= SHOWN_FROM_RAD_S
    return one.response.frequency[kept], one.response.value[kept]


def _degrees(w: Array, value: np.ndarray) -> Array:
    """Phase, counted on from that of (11), so that noise cannot turn it by a whole circle."""
    model = response_of(PITCH, w)
    phase: Array = np.degrees(np.unwrap(np.angle(model)) + np.angle(value / model))
    return phase


def _curve(one: tuple[str, Array, np.ndarray, str, bool], y: Array) -> Curve:
    name, x, _, role, dashed = one
    return Curve(name, x, y, role, dashed, width=4.0 if role == "truth" else 1.6)


def _panel(row: int, w: Array, label: str, unit: str, step: float, curves: Sequence[Curve]) -> Panel:
    low = float(np.floor(min(c.y.min() for c in curves) / step) * step)
    high = float(np.ceil(max(c.y.max() for c in curves) / step) * step)
    marks = tuple(Mark(x=edge, label=f"{edge:g} rad/s" if row == 0 else "") for edge in BAND)
    x = Scale("frequency", "rad/s", float(w[0]), float(w[-1]), log=True)
    return Panel(row, 0, x, Scale(label, unit, low, high, step=step), tuple(curves), marks=marks)

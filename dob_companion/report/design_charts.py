"""Figures of a design beside the paper's: Nyquist curve with its disk margin, roots, step and gust."""

from dataclasses import replace

import numpy as np

from dob_companion.report.chart import Array, Chart, Curve, Panel, Scale, rounded, symmetric
from dob_companion.report.draw import box
from dob_companion.synthesis.certify.behaviour import Complex, Roots, TimeResponse

_CIRCLE = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 241))


def nyquist(key: str, hertz: Array, off: Complex, on: Complex, disk_margin: float) -> Chart:
    """Open loop off and on over hertz, and the disk that the margin keeps free around −1.

    A disk margin a with skew 0 keeps L out of the disk whose diameter is [−(2+a)/(2−a), −(2−a)/(2+a)]
    (Seiler, Packard and Gahinet, IEEE Control Systems 40, 2020); at a = 2 and beyond it is a half-plane.
    """
    curves = [
        Curve("observer off", off.real, off.imag, "off", along=hertz),
        Curve("observer on", on.real, on.imag, "on", along=hertz),
        Curve("−1", np.array([-1.0]), np.array([0.0]), "bound", marker="x"),
    ]
    if disk_margin < 1.9:
        far, near = (2.0 + disk_margin) / (2.0 - disk_margin), (2.0 - disk_margin) / (2.0 + disk_margin)
        disk = -(far + near) / 2.0 + (far - near) / 2.0 * _CIRCLE
        curves.insert(0, Curve("", disk.real, disk.imag, "bound", dashed=True))
    curves.insert(0, Curve("", _CIRCLE.real, _CIRCLE.imag, "bound", width=0.7))
    alt = "Nyquist curves near −1, observer off and on, and the disk kept free."
    return _plane(key, alt, curves, middle=-0.8, reach=2.4, tall=2.0, step=1.0)


def pole_zero_map(key: str, plant: Roots, observer: Roots, closed_loop: Complex) -> Chart:
    """Poles (×) and zeros (○) in the z plane with the unit circle."""
    groups = (
        ("plant zeros", plant.zeros, "truth", "o"),
        ("plant poles", plant.poles, "truth", "x"),
        ("closed-loop poles", closed_loop, "bound", "x"),
        ("observer poles", observer.poles, "on", "x"),
    )
    curves = [Curve("", _CIRCLE.real, _CIRCLE.imag, "bound", width=0.9)]
    for name, values, role, marker in groups:
        if values.size:
            curves.append(Curve(name, values.real.astype(float), values.imag.astype(float), role, marker=marker))
    # Zeros far out would shrink the circle to a dot.
    reach = min(3.0, symmetric([np.abs(plant.zeros), np.ones(1)], 1.12))
    return _plane(key, "Poles and zeros in the z plane.", curves, middle=0.0, reach=reach, tall=1.2, step=0.5)


def _plane(key: str, alt: str, curves: list[Curve], *, middle: float, reach: float, tall: float, step: float) -> Chart:
    """A part of the complex plane in which a circle is one: `reach` to either side of `middle`, `tall` up and down, and
    as much more of one of them as equal scales need."""
    x, y = Scale("real part", "", -1.0, 1.0, step=step), Scale("imaginary part", "", -1.0, 1.0, step=step)
    chart = Chart(key, alt, (Panel(0, 0, x, y, tuple(curves)),), 560, 500)
    _, _, width, height = box(chart, chart.panels[0])
    unit = max(reach / width, tall / height)  # half of the plane's units a pixel
    x = replace(x, low=middle - unit * width, high=middle + unit * width)
    y = replace(y, low=-unit * height, high=unit * height)
    return replace(chart, panels=(replace(chart.panels[0], x=x, y=y),))


def time_response(key: str, what: str, r: TimeResponse) -> Chart:
    """Body rate off and on above, the disturbance and the estimate that acts against it below."""
    x = Scale("time", "s", 0.0, len(r.t) * float(r.t[1]))
    low, high = _room([r.rate_off, r.rate_on])
    rate = Scale("body rate", "rad/s", low, high)
    low, high = _room([r.d, r.d_hat])
    moment = Scale("moment", "normalized", low, high)
    panels = (
        Panel(
            0,
            0,
            x,
            rate,
            (Curve("observer off", r.t, r.rate_off, "off"), Curve("observer on", r.t, r.rate_on, "on")),
        ),
        Panel(
            1,
            0,
            x,
            moment,
            (Curve("d", r.t, r.d, "truth", width=3.0), Curve("d̂ as it acts", r.t, r.d_hat, "on", dashed=True)),
        ),
    )
    alt = f"Response to a {what}: body rate with the observer off and on, disturbance and estimate."
    return Chart(key, alt, panels, 560, 430, row_heights=(1.3, 1.0))


def _room(values: list[Array]) -> tuple[float, float]:
    spread = max(float(np.ptp(np.concatenate(values))), 1e-9)
    return rounded(values, spread / 20.0, spread / 30.0)

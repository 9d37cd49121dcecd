"""Robustness on the page of a design: the sentence of the certificate, and how far sampled plants spread."""

import numpy as np

from dob_companion.artifact import DobBlock
from dob_companion.report.chart import Array, Band, Chart, Curve, Mark, Panel, Scale, rounded
from dob_companion.report.claims import Claim
from dob_companion.report.page import PageFigure, figure
from dob_companion.report.words import number
from dob_companion.synthesis.robust.bands import Bands, Spread


def robust_claims(block: DobBlock) -> tuple[Claim, ...]:
    """What is proved over the stated uncertainty; none when none was stated."""
    extra = block.certificate.extra
    if "robust_safe_factor" not in extra:
        return ()

    def told(name: str, digits: int = 3) -> str:
        value = extra.get(f"robust_{name}")
        return number(float(value), digits) if isinstance(value, int | float) else "–"

    text = f"Every plant of the stated uncertainty made {told('safe_factor')} times as wide is proved stable with it; "
    if "robust_unsafe_factor" in extra:
        text += f"at {told('unsafe_factor')} times there is one that is not. "
    else:
        text += f"none up to {told('farthest_factor')} times was found that is not. "
    if "robust_gamma_bound" in extra:
        text += (
            f"With the weights asked for, γ = {told('gamma_nominal', 4)} of the model becomes at most "
            f"{told('gamma_bound', 4)} for the worst plant ({told('gamma_sampled', 4)} was met)."
        )
    stable = bool(extra.get("robust_stable"))
    return (Claim(stable, "Robust over the stated uncertainty." if stable else "Not robust as far as stated.", text),)


def robust_figures(key: str, block: DobBlock, bands: Bands | None) -> list[PageFigure]:
    """One figure an axis; none without an uncertainty."""
    if bands is None:
        return []
    found = []
    for i, axis in enumerate(block.axes):
        of = f" ({axis})" if len(block.axes) > 1 else ""
        caption = (
            f"{bands.tried} plants of the stated uncertainty: its model, its corners and random ones "
            f"({bands.stable} of them stable with the observer, and drawn). Lines are the model's. Above, disturbance "
            "to body rate, off and on; below, what the correction leaves."
        )
        if bands.allowed is not None:
            caption += " Dashed, the level that the bound of the worst γ guarantees to every plant."
        found.append(figure(robust_bands_chart(f"{key}-robust{i}", bands, i), f"Uncertain plants{of}.", caption))
    return found


def robust_bands_chart(key: str, bands: Bands, axis: int) -> Chart:
    """d → y with the observer off and on above, the estimation error and its bound below; one axis, dB."""
    hertz = bands.frequency_hz
    x = Scale("frequency", "Hz", float(hertz[0]), float(hertz[-1]), log=True)
    rates = [("off", "observer off", bands.rate_off), ("on", "observer on", bands.rate_on)]
    above = _panel(0, x, hertz, axis, rates, "d → y")
    below = _panel(1, x, hertz, axis, [("on", "d → d − d̂ delayed", bands.error)], "error", bands.allowed)
    alt = "Bands of the response from disturbance to body rate and of the estimation error over sampled plants."
    return Chart(key, alt, (above, below), 560, 460, row_heights=(1.0, 1.0))


def _panel(
    row: int,
    x: Scale,
    hertz: Array,
    axis: int,
    spreads: list[tuple[str, str, Spread]],
    label: str,
    allowed: Array | None = None,
) -> Panel:
    shaded = tuple(Band("", hertz, _db(s.low[:, axis]), _db(s.high[:, axis]), role) for role, _, s in spreads)
    curves = tuple(Curve(name, hertz, _db(s.model[:, axis]), role) for role, name, s in spreads)
    low, high = rounded([edge for band in shaded for edge in (band.low, band.high)], 20.0)
    if allowed is not None:
        curves = (Curve("worst γ / |W_d|", hertz, _db(allowed[:, axis]), "bound", dashed=True), *curves)
        high = max(high, min(rounded([_db(allowed[:, axis])], 20.0)[1], high + 20.0))
    low = max(low, high - 100.0)
    marks = (Mark(y=0.0),) if low < 0.0 < high else ()
    return Panel(row, 0, x, Scale(label, "dB", low, high, step=20.0), curves, shaded, marks)


def _db(size: Array) -> Array:
    return np.asarray(20.0 * np.log10(np.maximum(size, 1e-12)))

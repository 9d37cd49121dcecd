"""From a record to a model, and what a sweep leaves behind. Pure but for `write`."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import find_peaks

from sitl.airframe.linear import RateAxis
from sitl.constants import DT
from sitl.sweep.estimate import Response, frequency_response
from sitl.sweep.fit import BAND, Fit, fit_rate_axis, response_of
from sitl.sweep.multisine import Floats, Plan, measured

POOR, PROVEN = 0.03, 9.0
"""Where the paper's form misfits by more than this, and by thrice what noise explains (χ²), the integrator is let go:
the air damps what turns slowly."""


PROMINENT = 3.0
"""A peak this many dB above its surroundings is a flexible mode."""


@dataclass(frozen=True, slots=True)
class Identified:
    """One axis as the sweep found it: its frequency response u_e → y_n, and the model fitted to that."""

    axis: str
    response: Response
    fit: Fit


def identify(axis: str, plan: Plan, record: Floats, band: tuple[float, float] = BAND) -> Identified:
    """Estimate and fit from `SweepClient.records`: u_e, y_n and the correction that acted, shape (3, plan.samples)."""
    u, y, r = (measured(plan, signal) for signal in record)
    response = frequency_response(r, u, y, plan.lines)
    fit = fit_rate_axis(response, band)
    if fit.worst > POOR and fit.chi2 > PROVEN:
        fit = fit_rate_axis(response, band, integrator=False)
    return Identified(axis, response, fit)


def table(found: list[Identified]) -> str:
    """What a person wants to see: one line an axis, each number with its standard deviation."""
    head = ("axis", "gain", "zero", "pole", "slow pole", "rad/s²", "misfit", "χ²")
    rows = [head]
    for one in found:
        m, d = one.fit.model, one.fit.deviation
        slow = f"{m.slow:.5f} ± {d.slow:.5f}" if d.slow else "1"
        numbers = (f"{m.gain:.5f} ± {d.gain:.5f}", f"{m.zero:+.3f} ± {d.zero:.3f}", f"{m.pole:.5f} ± {d.pole:.5f}")
        rows.append((one.axis, *numbers, slow, f"{acceleration(m):.0f}", f"{one.fit.worst:.1%}", f"{one.fit.chi2:.1f}"))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)


def acceleration(model: RateAxis) -> float:
    """Angular acceleration per unit of torque once the rotors have followed, rad/s²."""
    return model.gain * (1.0 - model.zero) / (1.0 - model.pole) / DT


def modes(one: Identified) -> list[tuple[float, float]]:
    """Peaks over the rigid model above the fitted band: frequency in rad/s, height over the model in dB."""
    response = one.response
    above = response.frequency > one.fit.band[1]
    w, value = response.frequency[above], response.value[above]
    height = 20.0 * np.log10(np.abs(value / response_of(one.fit.model, w)))
    peaks, _ = find_peaks(height, prominence=PROMINENT, wlen=len(w) // 4)
    return [(float(w[i]), float(height[i])) for i in peaks]


def spec(found: list[Identified]) -> str:
    """The plants as TOML, in the form of a design spec's blocks."""
    lines = []
    for one in found:
        m, d = one.fit.model, one.fit.deviation
        low, high = one.fit.band
        lines += [
            f"# {one.axis}: fitted over {low:g} to {high:g} rad/s, misfit at most {one.fit.worst:.2%}.",
            f"# Standard deviations: zero {d.zero:.2g}, pole {d.pole:.2g}, gain {d.gain:.2g}",
            "[[block]]",
            f'name = "{one.axis}"',
            f'axes = ["{one.axis}"]',
            "[block.plant]",
            f"zeros = [{m.zero:.5g}]",
            f"poles = [{m.slow:.6g}, {m.pole:.6g}]",
            f"gain = {m.gain:.6g}",
            "",
        ]
    return "\n".join(lines)


def write(found: list[Identified], records: list[Floats], directory: Path) -> None:
    """Write `plants.toml`, and per axis `AXIS.npz` with the record and the response."""
    directory.mkdir(parents=True, exist_ok=True)
    for one, record in zip(found, records, strict=True):
        u_e, gyro, correction = record
        response = one.response
        np.savez_compressed(
            directory / f"{one.axis}.npz",
            u_e=u_e,
            gyro=gyro,
            correction=correction,
            frequency=response.frequency,
            response=response.value,
            deviation=response.deviation,
            coherence_u=response.coherence_u,
            coherence_y=response.coherence_y,
        )
    (directory / "plants.toml").write_text(spec(found), "utf-8")

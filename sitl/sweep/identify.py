"""From a record to a model, and what a sweep leaves behind. Pure but for `write`."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sitl.dynamics import DT
from sitl.sweep.estimate import Response, frequency_response
from sitl.sweep.fit import BAND, Fit, fit_rate_axis
from sitl.sweep.multisine import Floats, Plan, measured


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
    return Identified(axis, response, fit_rate_axis(response, band))


def table(found: list[Identified]) -> str:
    """What a person wants to see: one line an axis, each number with its standard deviation."""
    lines = ["axis    gain                 zero               pole                 slope  worst misfit   χ²"]
    for one in found:
        m, d = one.fit.model, one.fit.deviation
        lines.append(
            f"{one.axis:<6}  {m.gain:.5f} ± {d.gain:.5f}   {m.zero:+.3f} ± {d.zero:.3f}    {m.pole:.5f} ± {d.pole:.5f}"
            f"  {slope(one):6.0f}  {one.fit.worst:12.2%} {one.fit.chi2:5.1f}"
        )
    return "\n".join(lines)


def slope(one: Identified) -> float:
    """Angular acceleration per unit of torque below the pole, rad/s²."""
    m = one.fit.model
    return m.gain * (1.0 - m.zero) / (1.0 - m.pole) / DT


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
            f"poles = [1.0, {m.pole:.6g}]",
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

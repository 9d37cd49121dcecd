"""The comparison as text and as JSON."""

import math
from textwrap import wrap
from typing import Any

from dob_companion.comparison.evaluate import OFF_NOMINAL, AxisComparison, Row
from dob_companion.comparison.shortfall import Shortfall, Step, shortfall_table
from dob_companion.lti.margins import MOST_DELAY_SAMPLES

RULE = (
    "Tuned: least expected RMS attitude error with no smaller a disk margin and no more gyro noise in the correction "
    "than the H∞ design."
)
UNTUNED = "not held to the rule"

_GROUPS = (
    ("attenuation", "peak, rad", "n→d̂ RMS", "disk", "delay"),
    (*(name for name, _ in OFF_NOMINAL), "order"),
    ("n→d̂ peak", "settings"),
)
"""What stands beside the methods in one table, so that each fits a terminal of 80 columns."""

_COLUMNS = (
    "method",
    "attenuation",
    "peak, rad",
    "n→d̂ peak",
    "n→d̂ RMS",
    "disk",
    "delay",
    "order",
    *(name for name, _ in OFF_NOMINAL),
    "settings",
)


def comparison_table(axis: AxisComparison) -> str:
    """One axis as aligned text: a row a method, then who wins which column."""
    flights = len(axis.rows[0].attenuation)
    lines = [
        f"{axis.axis}: RMS attitude error off / on, link delay {axis.delay}; mean ± standard deviation",
        f"over {flights} flight{'s' * (flights > 1)} that peak at {axis.peak_off:g} rad with the observer off",
    ]
    for columns in _GROUPS:
        lines += [*_group(axis, columns), ""]
    lines += [f"{name}: none ({reason})" for name, reason in axis.absent]
    lines += [line for text in verdicts(axis) for line in wrap(text, 80, initial_indent="  ", subsequent_indent="    ")]
    return "\n".join([*lines, *shortfall_table(axis.shortfall)])


def verdicts(axis: AxisComparison) -> list[str]:
    """Who is best at what among the observers held to the rule, in words."""
    rows = [row for row in axis.rows if row.tuned and row.key != "off"]
    best, second = sorted(rows, key=lambda row: -row.mean)[:2] if len(rows) > 1 else (rows[0], rows[0])
    ahead = sum(a > b for a, b in zip(best.attenuation, second.attenuation, strict=True))
    margin, fewest = max(rows, key=lambda row: row.disk_margin), min(row.order for row in rows)
    return [
        f"most attenuation at the same price: {best.name} ({best.mean:.2f}), ahead of {second.name} "
        f"({second.mean:.2f}) in {ahead} of {len(best.attenuation)} flights",
        f"largest disk margin: {margin.name} ({margin.disk_margin:.3f})",
        f"fewest states: {', '.join(row.name for row in rows if row.order == fewest)} ({fewest})",
    ]


def comparison_object(axes: tuple[AxisComparison, ...]) -> dict[str, Any]:
    """The comparison as it is written to comparison.json; an attenuation of an unstable loop is null."""
    return {
        "schema": "dob-companion/comparison/1",
        "rule": RULE,
        "axes": {axis.axis: _axis_object(axis) for axis in axes},
    }


def _axis_object(axis: AxisComparison) -> dict[str, Any]:
    return {
        "delay_samples": axis.delay,
        "peak_off": axis.peak_off,
        "disturbance_sigma": axis.scale,
        "most_attenuation": axis.best.key,
        "methods": {row.key: _row_object(row) for row in axis.rows},
        "absent": dict(axis.absent),
        "lqg": _shortfall_object(axis.shortfall),
    }


def _shortfall_object(found: Shortfall) -> dict[str, Any]:
    """Expected attenuations of the design, of the best at its price, of the bound, and what single changes bring."""
    return {
        "rms_off": found.off,
        "excess": found.excess,
        "design": _step_object(found.design),
        "at_price": _step_object(found.at_price),
        "bound": _step_object(found.bound),
        "steps": [_step_object(step) for step in found.steps],
    }


def _step_object(step: Step) -> dict[str, Any]:
    return {
        "name": step.name,
        "expected_attenuation": step.attenuation,
        "noise_rms": step.noise,
        "disk_margin": step.disk_margin,
        "delay_margin_samples": step.delay_margin,
    }


def _row_object(row: Row) -> dict[str, Any]:
    return {
        "name": row.name,
        "source": row.source,
        "settings": row.settings,
        "tuned": row.tuned,
        "attenuation_mean": row.mean,
        "attenuation_std": row.spread,
        "attenuation": list(row.attenuation),
        "peak_on": row.peak,
        "noise_peak_db": row.noise_peak_db if math.isfinite(row.noise_peak_db) else None,
        "noise_rms": row.noise_rms,
        "disk_margin": row.disk_margin,
        "delay_margin_samples": row.delay_margin,
        "order": row.order,
        "expected_attenuation": dict(row.off_nominal),
    }


def cells(row: Row) -> dict[str, str]:
    """A row's values as text, by column name."""
    return dict(zip(_COLUMNS, _cells(row), strict=True))


def _cells(row: Row) -> tuple[str, ...]:
    noisy = row.noise_rms > 0.0
    delay = f"≥{row.delay_margin}" if row.delay_margin == MOST_DELAY_SAMPLES else str(row.delay_margin)
    return (
        row.name,
        f"{row.mean:.2f} ± {row.spread:.2f}",
        f"{row.peak:.4f}",
        f"{row.noise_peak_db:.1f} dB".replace("-", "−") if noisy else "–",
        f"{row.noise_rms:.2e}".replace("e-0", "e−") if noisy else "–",
        f"{row.disk_margin:.3f}",
        delay,
        str(row.order),
        *("unstable" if value is None else f"{value:.2f}" for value in row.off_nominal.values()),
        row.settings,
    )


def _group(axis: AxisComparison, columns: tuple[str, ...]) -> list[str]:
    """Some columns of all methods, those not held to the rule last."""
    rows = [[row.name, *(cells(row)[name] for name in columns)] for row in axis.rows]
    widths = [max(map(len, column)) for column in zip(("method", *columns), *rows, strict=True)]

    def line(cells: list[str]) -> str:
        aligned = [
            cell.ljust(width) if name == "settings" else cell.rjust(width)
            for cell, width, name in zip(cells[1:], widths[1:], columns, strict=True)
        ]
        return "  ".join([cells[0].ljust(widths[0]), *aligned]).rstrip()

    lines = [line(["method", *columns])]
    lines += [line(cells) for row, cells in zip(axis.rows, rows, strict=True) if row.tuned]
    plain = [line(cells) for row, cells in zip(axis.rows, rows, strict=True) if not row.tuned]
    return [*lines, f"{UNTUNED}:", *plain] if plain else lines

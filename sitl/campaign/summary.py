"""What a campaign comes to: distributions by group, and the worst flights."""

from collections.abc import Iterable
from math import inf
from typing import Any

import numpy as np

from sitl.campaign.directory import Directory
from sitl.campaign.pilot import Row
from sitl.campaign.plan import Between, Campaign
from sitl.constants import AXES

SHOWN = ("rms_ratio", "peak_ratio", "peak_on", "max_correction")
"""Measures of each axis whose distribution the summary gives."""

WORST = 10

Summary = dict[str, Any]


def summarize(directory: Directory, rows: list[Row]) -> Summary:
    """Counts, distributions of each group of flights, and the worst flights' rows; plain values for JSON.

    A group holds all flights of one combination of what was chosen; seeds, and what was drawn for a seed, vary in it.
    """
    campaign = directory.campaign
    names = varied(campaign)
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in names), []).append(row)
    return {
        "flights": len(directory.flights),
        "flown": len(rows),
        "failed": sum(row["outcome"] != "complete" for row in rows),
        "missed": sum(bool(row["checks_missed"]) for row in rows),
        "groups": [
            {"inputs": dict(zip(names, values, strict=True)), **_distributions(members)}
            for values, members in groups.items()
        ],
        "worst": worst(rows),
    }


def varied(campaign: Campaign) -> list[str]:
    """Names of the inputs that were chosen several ways."""
    counts = {
        "airframe": len(campaign.airframes),
        "design": len(campaign.designs),
        "delay": len(campaign.delays),
        "gain": 1 if isinstance(campaign.gain, Between) else len(campaign.gain),
        "pole": 1 if isinstance(campaign.pole, Between) else len(campaign.pole),
        "wind_m_s": 1 if isinstance(campaign.wind_m_s, Between) else len(campaign.wind_m_s),
    }
    return [name for name, count in counts.items() if count > 1]


def worst(rows: Iterable[Row], most: int = WORST) -> list[Row]:
    """Failed flights first, then by checks missed, then those whose observer helped least on some axis (RMS off/on)."""
    return sorted(rows, key=_merit)[:most]


def _merit(row: Row) -> tuple[bool, int, float, int]:
    failed = row["outcome"] != "complete"
    ratios = [row[name] for axis in AXES if row.get(name := f"rms_ratio_{axis}") is not None]
    return not failed, -(row["checks_missed"] or 0), min(ratios, default=inf), row["flight"]


def _distributions(rows: list[Row]) -> dict[str, Any]:
    whole = [row for row in rows if row["outcome"] == "complete"]
    result: dict[str, Any] = {
        "flights": len(rows),
        "failed": len(rows) - len(whole),
        "missed": sum(bool(row["checks_missed"]) for row in whole),
    }
    if whole:
        result["injecting"] = min(row["injecting"] for row in whole)
        result["axes"] = {axis: _of_axis(whole, axis) for axis in AXES}
    return result


def _of_axis(rows: list[Row], axis: str) -> dict[str, dict[str, float] | None]:
    return {name: spread([row[f"{name}_{axis}"] for row in rows]) for name in SHOWN}


def spread(values: Iterable[float | None]) -> dict[str, float] | None:
    """Least, 5 %, median, 95 %, greatest of those that are numbers; None when none is."""
    numbers = [value for value in values if value is not None]
    if not numbers:
        return None
    low, p5, median, p95, high = np.percentile(numbers, (0, 5, 50, 95, 100)).tolist()
    return {"min": low, "p5": p5, "median": median, "p95": p95, "max": high}


def table(summary: Summary) -> str:
    """For a terminal: RMS off/on by group and axis, median and the range of 5 to 95 %."""
    heads = [f"{axis} RMS off/on" for axis in AXES]
    lines = [f"{'flights':>8} {'failed':>7} {'missed':>7}  " + "".join(f"{head:<24}" for head in heads)]
    for group in summary["groups"]:
        axes = group.get("axes")
        cells = [_cell(axes[axis]["rms_ratio"] if axes else None) for axis in AXES]
        counts = f"{group['flights']:>8} {group['failed']:>7} {group['missed']:>7}  "
        name = ", ".join(f"{key} {value}" for key, value in group["inputs"].items())
        lines.append(counts + "".join(f"{c:<24}" for c in cells) + name)
    return "\n".join(line.rstrip() for line in lines)


def _cell(found: dict[str, float] | None) -> str:
    return f"{found['median']:.2f} ({found['p5']:.2f}…{found['p95']:.2f})" if found else "–"

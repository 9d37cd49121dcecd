"""What `design --auto` prints: the trade-off of each block and what was chosen."""

from dataclasses import asdict
from typing import Any

_HEAD = (
    ("", "", "RMS", "any", "disk", "delay", "noise in", "slowest"),
    ("", "asked", "off / on", "order", "margin", "margin", "correction", "mode, s"),
)


def tuning_object(tuning: Any) -> dict[str, Any]:
    """A `synthesis.tune.limits.Tuning` for JSON, without what the search tried on its way."""
    from dob_companion.synthesis.tune.written import weight_table  # needs the extra [design]

    keys = ("asked", "chosen", "rows", "own", "disk_margin_off", "gamma_backoff", "order", "form", "limit")
    weights = {"disturbance": weight_table(tuning.disturbance), "noise": [weight_table(form) for form in tuning.noise]}
    return {key: asdict(tuning)[key] for key in keys} | weights | {"limited_by": list(tuning.limited_by)}


def tuning_table(tuning: Any) -> str:
    """The trade-off, the chosen row marked, and what limits it."""
    auto = tuning.auto
    rows = [_row("", _asked(tuning, row.asked), row.found, row.limit) for row in tuning.rows]
    rows.append(_row(">", "chosen: as [auto] asks", tuning.chosen, tuning.limit))
    if tuning.own:
        rows.append(_row("", "the spec's own weights", tuning.own))
    limits = " and ".join(tuning.limited_by) or "the number of states: no limit of [auto] binds"
    at = ", ".join(f"{value:.2f} at {gain:g}" for gain, value in zip(auto.gains, tuning.chosen.at_gains, strict=False))
    return "\n".join(
        [
            f"{tuning.name}: attitude error for {auto.disturbances}",
            f"with gyro noise of {auto.noise_rms:.3g} rad/s",
            *_aligned([*_HEAD, *rows]),
            *([f"at other gains of the plant: {at}"] if at else []),
            *(["any order: no observer exceeds that, with any delay margin and slowest mode"] if tuning.limit else []),
            f"limited by {limits}",
            f"without observer the disk margin is {tuning.disk_margin_off:.3f}",
            tuning.form,
        ]
    )


def _asked(tuning: Any, limits: Any) -> str:
    if limits.disk_margin != tuning.asked.disk_margin:
        return f"disk margin >= {limits.disk_margin:.3f}"
    return f"noise <= {limits.noise:.3g}"


def _row(mark: str, asked: str, m: Any, limit: float | None = None) -> tuple[str, ...]:
    return (
        mark,
        asked,
        f"{m.attenuation:.2f}",
        f"{limit:.2f}" if limit else "",
        f"{m.disk_margin:.3f}",
        f"{m.delay_margin:.1f}",
        f"{m.noise:.3g}",
        f"{m.slowest_s:.4f}",
    )


def _aligned(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join([mark.ljust(widths[0]), asked.ljust(widths[1]), *map(str.rjust, cells, widths[2:])])
        for mark, asked, *cells in rows
    ]

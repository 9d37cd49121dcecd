"""What `design --auto` prints: the trade-off of each block and the weights chosen."""

from dataclasses import asdict
from typing import Any

_HEAD = (
    ("", "", "RMS", "disk", "delay", "noise in", "slowest"),
    ("", "asked", "off / on", "margin", "margin", "correction", "mode, s"),
)


def tuning_object(tuning: Any) -> dict[str, Any]:
    """A `synthesis.tuning.Tuning` for JSON, without what the search tried on its way."""
    keys = ("asked", "knobs", "chosen", "rows", "own", "disk_margin_off", "disturbance", "noise")
    return {key: asdict(tuning)[key] for key in keys} | {"limited_by": list(tuning.limited_by)}


def tuning_table(tuning: Any) -> str:
    """The trade-off, the chosen row marked, what limits it, and the weights as a spec would state them."""
    auto, knobs = tuning.auto, tuning.knobs
    rows = [_row("", _asked(tuning, row.asked), row.found) for row in tuning.rows]
    rows.append(_row(">", "chosen: as [auto] asks", tuning.chosen))
    if tuning.own:
        rows.append(_row("", "the spec's own weights", tuning.own))
    limits = " and ".join(tuning.limited_by) or "the form of the weights: no limit of [auto] binds"
    crossing = f"crossing at {knobs.crossing_hz:.3g} Hz"
    lags = f"W_d {knobs.lags} lag{'s' * (knobs.lags > 1)} at {knobs.disturbance_hz:.3g} Hz, {crossing}"
    return "\n".join(
        [
            f"{tuning.name}: attitude error for {auto.disturbances}",
            f"with gyro noise of {auto.noise_rms:.3g} rad/s",
            *_aligned([*_HEAD, *rows]),
            f"limited by {limits}",
            f"without observer the disk margin is {tuning.disk_margin_off:.3f}",
            f"{lags}, W_n from {knobs.noise_hz:.3g} Hz",
            f"disturbance = {_toml(tuning.disturbance)}",
            *(f"noise = {_toml(form)}" for form in tuning.noise),
        ]
    )


def _asked(tuning: Any, limits: Any) -> str:
    if limits.disk_margin != tuning.asked.disk_margin:
        return f"disk margin >= {limits.disk_margin:.3f}"
    return f"noise <= {limits.noise:.3g}"


def _row(mark: str, asked: str, m: Any) -> tuple[str, ...]:
    return (
        mark,
        asked,
        f"{m.attenuation:.2f}",
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


def _toml(form: Any) -> str:
    """An inline table of real roots."""
    zeros, poles = ([root.real for root in roots] for roots in (form.zeros, form.poles))
    return f"{{ zeros = {zeros}, poles = {poles}, gain = {form.gain!r} }}"

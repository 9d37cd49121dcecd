"""What the live views of `run` and `demo` have in common. rich (extra `[view]`) is loaded when something is drawn."""

from collections.abc import Sequence
from typing import Any

FULL_SCALE = 0.3
"""d_hat at which a bar is full, normalized torque: DOB_LIMIT's default."""

BAR_HALF = 16
_STATE_STYLES = {"ACTIVE": "bold green", "FAULT": "bold red", "RAMP_IN": "bold yellow", "RAMP_OUT": "bold yellow"}
_SEVERITY_STYLES = {"EMERGENCY": "bold red", "ALERT": "bold red", "CRITICAL": "bold red", "ERROR": "red"}
_SEVERITY_STYLES |= {"WARNING": "yellow", "NOTICE": "bold"}


def bar(value: float, full_scale: float = FULL_SCALE, half: int = BAR_HALF) -> str:
    """A value as a bar that grows from the middle, `half` characters to either side at `full_scale`."""
    filled = min(half, round(half * abs(value) / full_scale)) if full_scale > 0.0 else 0
    left = ("█" * filled if value < 0 else "").rjust(half)
    right = ("█" * filled if value > 0 else "").ljust(half)
    return f"{left}│{right}"


def axis_bars(
    names: Sequence[str],
    d_hat: Sequence[float],
    correction: Sequence[float] | None = None,
    *,
    full_scale: float = FULL_SCALE,
    half: int = BAR_HALF,
) -> Any:
    """A row an axis: name, bar of d_hat, its value, and the correction if given. Normalized torque, hover axes."""
    from rich.table import Table

    table = Table.grid(padding=(0, 1))
    for index, (name, value) in enumerate(zip(names, d_hat, strict=True)):
        cells = [f"{name:5}", bar(value, full_scale, half), f"d_hat {value:+.4f}"]
        if correction is not None:
            cells.append(f" correction {correction[index]:+.4f}")
        table.add_row(*cells)
    return table


def headline(state: str, *cells: Any) -> Any:
    """The state in its colour, and what belongs beside it."""
    from rich.table import Table
    from rich.text import Text

    table = Table.grid(padding=(0, 2))
    table.add_row(Text(f"{state:9}", style=_STATE_STYLES.get(state, "bold")), *cells)
    return table


def severity_style(severity: str) -> str:
    """How a log line of this severity looks."""
    return _SEVERITY_STYLES.get(severity, "")

"""A figure as data: what is drawn, not how. `draw` makes the SVG of it and `page.js` redraws it when zoomed.

Panels stand in a grid of rows and columns; the panels of a column share their x axis. All arrays are one-dimensional
and in the units that the scales name.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """y over x, or loose points when `marker` is "x" or "o". `role` names a colour of the palette.

    `along` makes it a path in the plane (a Nyquist curve): what the readout says of each point, in Hz.
    """

    name: str
    x: Array
    y: Array
    role: str
    dashed: bool = False
    marker: str = ""
    width: float = 1.6
    along: Array | None = None

    def __post_init__(self) -> None:
        if self.x.shape != self.y.shape or self.x.ndim != 1:
            raise ValueError(f"curve {self.name!r}: x is {self.x.shape} and y {self.y.shape}, expected equal lengths")


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """The area between `low` and `high` over x, shaded in the colour of `role`."""

    name: str
    x: Array
    low: Array
    high: Array
    role: str


@dataclass(frozen=True, slots=True)
class Mark:
    """A thin vertical line at x with a word beside it, or a horizontal one at y."""

    x: float | None = None
    y: float | None = None
    label: str = ""


@dataclass(frozen=True, slots=True)
class Scale:
    """An axis: what it shows, in which unit, from `low` to `high`; `step` fixes the distance of its ticks.

    With `names` it shows kinds, not a quantity: a tick at each of 0, 1, 2 … bears its name.
    """

    label: str
    unit: str
    low: float
    high: float
    log: bool = False
    step: float | None = None
    names: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """Label and unit as written beside the axis."""
        return f"{self.label}, {self.unit}" if self.unit else self.label


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One pair of axes at (row, col) of its chart."""

    row: int
    col: int
    x: Scale
    y: Scale
    curves: tuple[Curve, ...]
    bands: tuple[Band, ...] = ()
    marks: tuple[Mark, ...] = ()
    title: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """A figure of `width` by `height` CSS pixels. `key` is its id in the page; `alt` describes it without sight."""

    key: str
    alt: str
    panels: tuple[Panel, ...]
    width: int = 560
    height: int = 400
    row_heights: tuple[float, ...] = (1.0,)
    col_widths: tuple[float, ...] = (1.0,)


def rounded(values: Iterable[Array], step: float, pad: float = 0.0) -> tuple[float, float]:
    """Limits that hold all finite `values` with `pad` to spare, at whole multiples of `step`."""
    joined = np.concatenate([np.ravel(v) for v in values])
    finite = joined[np.isfinite(joined)]
    if not finite.size:
        return 0.0, step
    low = float(np.floor((finite.min() - pad) / step) * step)
    high = float(np.ceil((finite.max() + pad) / step) * step)
    high = high if high > low else low + step
    return low, max(high, low + 1e-9 * abs(low))  # beside a large number a small step is nothing


def symmetric(values: Iterable[Array], pad: float = 1.08) -> float:
    """Half-width of a limit symmetric about zero that holds all finite `values`."""
    joined = np.abs(np.concatenate([np.ravel(v) for v in values]))
    finite = joined[np.isfinite(joined)]
    peak = float(finite.max()) if finite.size else 0.0
    return peak * pad if peak > 0.0 else 1.0


def envelope(x: Array, y: Array, columns: int) -> tuple[Array, Array]:
    """The least and the greatest sample in each of `columns` equal stretches, in order: what a screen can show.

    A trace of at most 2 * columns samples comes back as it is. Stretches keep every peak, which plain thinning loses.
    """
    n = len(y)
    if n <= 2 * columns:
        return x, y
    starts = np.arange(columns) * n // columns
    ends = np.append(starts[1:], n)
    kept = [0]
    for start, end in zip(starts, ends, strict=True):
        stretch = y[start:end]
        kept += sorted((int(start + np.argmin(stretch)), int(start + np.argmax(stretch))))
    index = np.unique(np.append(kept, n - 1))
    return x[index], y[index]

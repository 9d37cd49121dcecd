"""Messages of one kind as columns, whatever file they stood in."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dob_companion.identification.record import Floats
from dob_companion.logs.series import Series


@dataclass(frozen=True, slots=True)
class Table:
    """Messages of one name.

    place    (n,) where each stands in the file, rising
    numbers  the column of this name, (n,); raises KeyError where there is none or it is no number
    texts    the same for words
    names    of the columns
    units    of the columns, as far as the file says: "rad/s", "deg/s", …
    """

    place: NDArray[np.int64]
    names: tuple[str, ...]
    numbers: Callable[[str], Floats]
    texts: Callable[[str], list[str]]
    units: dict[str, str]
    kept: NDArray[np.bool_] | None = None

    def column(self, name: str) -> Floats:
        """The values of a column."""
        values = self.numbers(name)
        return values if self.kept is None else values[self.kept]

    def has(self, names: Sequence[str]) -> bool:
        """Whether all these columns are there."""
        return all(name in self.names for name in names)

    def where(self, keep: NDArray[np.bool_]) -> "Table":
        """Some of the messages."""
        whole = keep if self.kept is None else self.kept.copy()
        if self.kept is not None:
            whole[self.kept] = keep
        return replace(self, place=self.place[keep], kept=whole)

    def series(self, time: Floats, names: Sequence[str], scale: float = 1.0) -> Series:
        """Some columns as a signal."""
        columns = [self.column(name) for name in names]
        values = np.column_stack(columns) if columns else np.empty((len(self.place), 0))
        return Series(self.place, time, scale * values)

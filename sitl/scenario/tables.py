"""TOML tables taken apart key by key, with errors that name file, key and what was expected."""

import tomllib
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitl.attitude import Vector
from sitl.constants import AXES
from sitl.errors import InputError, ScenarioError


def read(path: Path, error: type[InputError] = ScenarioError) -> dict[str, Any]:
    """A TOML file as Python values. Raises `error`, one line that names the file."""
    try:
        return tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError) as trouble:
        raise error(f"{path}: cannot be read as UTF-8 text: {trouble}") from None
    except (ValueError, RecursionError) as trouble:  # also a number of 5000 digits, 3000 nested arrays
        raise error(f"{path}: not TOML: {trouble}") from None


class Table:
    """One TOML table whose keys are taken out one by one; `finish` complains about those nobody asked for.

    Every method raises ScenarioError.
    """

    def __init__(self, file: str, name: str, content: dict[str, Any]) -> None:
        self.file, self._name, self._left = file, name, dict(content)
        self._known: list[str] = []

    def where(self, key: str) -> str:
        """File and full key, as errors begin."""
        return f"{self.file}: {self._name}.{key}" if self._name else f"{self.file}: {key}"

    def _take(self, key: str) -> Any:
        self._known.append(key)
        return self._left.pop(key, None)

    def has(self, key: str) -> bool:
        """Whether the key is there; it counts as known from now on."""
        if key not in self._known:
            self._known.append(key)
        return key in self._left

    def text(self, key: str) -> str:
        """Text that must be there."""
        value = self._take(key)
        if not isinstance(value, str):
            raise ScenarioError(f"{self.where(key)}: expected text{self._instead(key)}")
        return value

    def choice(self, key: str, known: tuple[str, ...], default: str | None = None) -> str:
        """One word of several."""
        if default is not None and not self.has(key):
            return default
        value = self.text(key)
        if value not in known:
            hint = nearest(value, list(known)) or f"expected one of {', '.join(known)}"
            raise ScenarioError(f"{self.where(key)}: {value!r} is unknown; {hint}")
        return value

    def number(self, key: str, low: float, high: float, default: float | None = None) -> float:
        """A finite number within bounds; with a `default` it may be absent."""
        if default is not None and not self.has(key):
            return default
        return self._number(key, self._take(key), low, high)

    def _number(self, key: str, value: Any, low: float, high: float) -> float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not low <= value <= high:  # nor what is not a number
            raise ScenarioError(f"{self.where(key)}: expected a number from {low:g} to {high:g}{self._instead(key)}")
        return float(value)

    def whole(self, key: str, low: int, high: int, default: int | None = None) -> int:
        """A whole number within bounds."""
        value = self.number(key, low, high, default)
        if value != int(value):
            raise ScenarioError(f"{self.where(key)}: expected a whole number from {low} to {high}")
        return int(value)

    def numbers(self, key: str) -> tuple[float, ...] | None:
        """A number or a list of them; None when absent."""
        if not self.has(key):
            return None
        value = self._take(key)
        values = value if isinstance(value, list) and value else [value]
        return tuple(self._number(key, v, -1e9, 1e9) for v in values)

    def vector(self, key: str, names: tuple[str, ...], low: float, high: float) -> Vector:
        """A table of three components by name; one that is absent is zero."""
        table = self.table(key)
        x, y, z = (table.number(name, low, high, 0.0) for name in names)
        table.finish()
        return x, y, z

    def yes(self, key: str) -> bool:
        """True or false; false when absent."""
        if not self.has(key):
            return False
        value = self._take(key)
        if not isinstance(value, bool):
            raise ScenarioError(f"{self.where(key)}: expected true or false")
        return value

    def axes(self, low: float, high: float) -> Vector:
        """The whole table as roll, pitch and yaw, which must all be there."""
        roll, pitch, yaw = (self.number(axis, low, high) for axis in AXES)
        self.finish()
        return roll, pitch, yaw

    def table(self, key: str) -> "Table":
        """A table that must be there."""
        table = self.optional_table(key)
        if table is None:
            raise ScenarioError(f"{self.where(key)}: expected a table{self._instead(key)}")
        return table

    def optional_table(self, key: str) -> "Table | None":
        """A table, or None."""
        value = self._take(key)
        if value is None:
            return None
        if not isinstance(value, dict):
            raise ScenarioError(f"{self.where(key)}: expected a table")
        return Table(self.file, f"{self._name}.{key}".lstrip("."), value)

    def tables(self, key: str) -> list["Table"]:
        """The tables of an array of tables, `[[key]]`, counted from 1 in errors; none when absent."""
        value = self._take(key)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
            raise ScenarioError(f"{self.where(key)}: expected tables, each headed [[{key}]]")
        return [Table(self.file, f"{self._name}.{key}[{i}]".lstrip("."), v) for i, v in enumerate(value, 1)]

    def items(self, key: str) -> list["Table"]:
        """The tables of a list that must be there and hold one, counted from 0 in errors."""
        value = self._take(key)
        if not isinstance(value, list) or not value or not all(isinstance(v, dict) for v in value):
            raise ScenarioError(f"{self.where(key)}: expected a list of objects{self._instead(key)}")
        return [Table(self.file, f"{self._name}.{key}[{i}]".lstrip("."), v) for i, v in enumerate(value)]

    def texts(self, key: str) -> list[str]:
        """A list of texts that must be there."""
        value = self._take(key)
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
            raise ScenarioError(f"{self.where(key)}: expected a list of texts{self._instead(key)}")
        return value

    def length(self, key: str) -> int:
        """How many rows a matrix has that must be there; it stays to be read."""
        value = self._left.get(key)
        if not isinstance(value, list):
            raise ScenarioError(f"{self.where(key)}: expected a matrix{self._instead(key)}")
        return len(value)

    def matrix(self, key: str, rows: int, columns: int) -> NDArray[np.float64]:
        """A list of rows of numbers, (rows, columns); without rows or columns an empty list will do."""
        self.length(key)
        value = self._take(key)
        if rows * columns == 0 and not any(value):
            return np.zeros((rows, columns))
        if len(value) != rows or not all(isinstance(row, list) and len(row) == columns for row in value):
            raise ScenarioError(f"{self.where(key)}: expected a matrix of {rows} rows and {columns} columns")
        return np.array([[self._number(key, v, -1e12, 1e12) for v in row] for row in value])

    def _instead(self, key: str) -> str:
        """A hint where a missing key stands in the file under a misspelt name."""
        close = get_close_matches(key, self._left, 1)
        return f"; {close[0]!r} is unknown, did you mean {key!r}?" if close else ""

    def finish(self) -> None:
        """Complain about the first key that nobody asked for."""
        for key in self._left:
            hint = nearest(key, self._known) or f"known: {', '.join(self._known)}"
            raise ScenarioError(f"{self.where(key)}: unknown key; {hint}")


def nearest(word: str, known: list[str]) -> str:
    """A question naming the nearest known word, or nothing."""
    close = get_close_matches(word, known, 1, cutoff=0.5)
    return f"did you mean {close[0]!r}?" if close else ""

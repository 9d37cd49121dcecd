"""Typed access to one TOML table; every complaint is one line that names the place and the key."""

import sys
from collections.abc import Callable, Iterable
from typing import Any

from dob_companion.errors import SpecError, unknown_key


class Table:
    """A TOML table under the name `where`, whose keys must be among `known`.

    Raises SpecError: on anything but a table, on an unknown key (naming the nearest known one), and
    from each reader on a missing key, a wrong type or a number that is not finite.
    """

    def __init__(self, where: str, raw: object, known: Iterable[str] | None = None) -> None:
        if not isinstance(raw, dict):
            raise SpecError(f"{where}: expected a table")
        self.where, self._raw, self.known = where, raw, tuple(known or ())
        if known is not None:
            self.expect(self.known)

    def __contains__(self, key: str) -> bool:
        return key in self._raw

    def __len__(self) -> int:
        return len(self._raw)

    def expect(self, known: Iterable[str]) -> None:
        """Refuse a key that is not in `known`."""
        known = tuple(known)
        for key in self._raw:
            if key not in known:
                raise SpecError(f"{self.where}: {unknown_key(key, known)}")

    def without(self, keys: Iterable[str]) -> "Table":
        """The same table less some keys."""
        dropped = set(keys)
        return Table(self.where, {k: v for k, v in self._raw.items() if k not in dropped})

    def get(self, key: str) -> Any:
        """The value as TOML gave it."""
        if key not in self._raw:
            raise SpecError(f"{self.where}: key {key!r} is missing")
        return self._raw[key]

    def open(self, key: str) -> "Table":
        """An inner table; the caller checks its keys."""
        return Table(f"{self.where}: {key}", self.get(key))

    def table(self, key: str, known: Iterable[str]) -> "Table":
        """An inner table with these keys."""
        inner = self.open(key)
        return Table(inner.where, inner._raw, known)

    def tables(self, key: str) -> list[Any]:
        """The items of an array of tables."""
        value = self.get(key)
        if not isinstance(value, list):
            raise SpecError(f"{self.where}: {key}: expected [[{key}]] tables")
        return value

    def items(self, key: str) -> list[Any]:
        """The items of an array."""
        value = self.get(key)
        if not isinstance(value, list):
            raise SpecError(f"{self.where}: {key}: expected an array")
        return value

    def text(self, key: str) -> str:
        """A non-empty string."""
        value = self.get(key)
        if not isinstance(value, str) or not value:
            raise SpecError(f"{self.where}: {key}: expected a non-empty string, got {shown(value)}")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """An array of strings."""
        value = self.items(key)
        if not all(isinstance(item, str) for item in value):
            raise SpecError(f"{self.where}: {key}: expected an array of strings, got {shown(value)}")
        return tuple(value)

    def choice(self, key: str, among: tuple[str, ...], default: str) -> str:
        """One of a few words."""
        value = self._raw.get(key, default)
        if value not in among:
            raise SpecError(f"{self.where}: {key}: expected one of {', '.join(among)}, got {shown(value)}")
        return str(value)

    def whole(self, key: str, default: int, most: int | None = None) -> int:
        """A whole number >= 0, at most `most`."""
        value = self._raw.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < 0 or (most is not None and value > most):
            limit = "0 or more" if most is None else f"0 or more, at most {most}"
            raise SpecError(f"{self.where}: {key}: expected a whole number of {limit}, got {shown(value)}")
        return value

    def number(
        self,
        key: str,
        fits: Callable[[float], bool] = lambda _: True,
        expected: str = "a finite number",
        default: float | None = None,
    ) -> float:
        """A finite number that `fits`; `expected` says so in words."""
        value = self.get(key) if default is None else self._raw.get(key, default)
        if not is_number(value) or not fits(float(value)):
            raise SpecError(f"{self.where}: {key}: expected {expected}, got {shown(value)}")
        return float(value)

    def numbers(self, key: str) -> tuple[float, ...]:
        """An array of finite numbers."""
        value = self.items(key)
        if not all(is_number(item) for item in value):
            raise SpecError(f"{self.where}: {key}: expected an array of finite numbers, got {shown(value)}")
        return tuple(float(item) for item in value)

    def matrix(self, key: str) -> tuple[tuple[float, ...], ...]:
        """An array of equally long rows of finite numbers."""
        rows = self.items(key)
        if not all(isinstance(row, list) and all(is_number(item) for item in row) for row in rows):
            raise SpecError(f"{self.where}: {key}: expected rows of finite numbers")
        if len({len(row) for row in rows}) > 1:
            raise SpecError(f"{self.where}: {key}: expected rows of equal length")
        return tuple(tuple(float(item) for item in row) for row in rows)


def is_number(value: object) -> bool:
    """Whether TOML gave a number that a float can hold; its whole numbers know no bounds."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max


def shown(value: object) -> str:
    """A value in a message: as Python writes it, and no longer than a line bears."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= 80 else f"{text[:79]}…"

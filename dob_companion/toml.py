"""TOML texts, read key by key; every complaint is one line that names the place, the key and what was expected."""

import sys
import tomllib
from collections.abc import Callable, Iterable
from typing import Any

from dob_companion.errors import InputError, SpecError, unknown_key


def read(text: str, source: str, error: type[InputError] = SpecError) -> dict[str, Any]:
    """The document as Python values. Raises `error`, one line that begins with `source`, when it is not TOML."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as problem:  # also a number of 5000 digits, 3000 nested arrays
        raise error(f"{source}: not TOML: {problem}") from None


class Table:
    """A TOML table under the name `where`, whose keys must be among `known`.

    Raises `error`: on anything but a table, on an unknown key (naming the nearest known one), and
    from each reader on a missing key, a wrong type or a number that is not finite.
    """

    def __init__(
        self, where: str, raw: object, known: Iterable[str] | None = None, error: type[InputError] = SpecError
    ) -> None:
        if not isinstance(raw, dict):
            raise error(f"{where}: expected a table")
        self.where, self._raw, self.known, self._error = where, raw, tuple(known or ()), error
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
                raise self._error(f"{self.where}: {unknown_key(key, known)}")

    def without(self, keys: Iterable[str]) -> "Table":
        """The same table less some keys."""
        dropped = set(keys)
        return Table(self.where, {k: v for k, v in self._raw.items() if k not in dropped}, None, self._error)

    def with_own(self, own: "Table") -> "Table":
        """The same table with the keys of another in the place of its own, and under the other's name."""
        return Table(own.where, self._raw | own._raw, None, self._error)

    def get(self, key: str) -> Any:
        """The value as TOML gave it."""
        if key not in self._raw:
            raise self._error(f"{self.where}: key {key!r} is missing")
        return self._raw[key]

    def open(self, key: str) -> "Table":
        """An inner table; the caller checks its keys."""
        return Table(f"{self.where}: {key}", self.get(key), None, self._error)

    def table(self, key: str, known: Iterable[str]) -> "Table":
        """An inner table with these keys."""
        inner = self.open(key)
        return Table(inner.where, inner._raw, known, self._error)

    def tables(self, key: str) -> list[Any]:
        """The items of an array of tables."""
        value = self.get(key)
        if not isinstance(value, list):
            raise self._error(f"{self.where}: {key}: expected [[{key}]] tables")
        return value

    def items(self, key: str) -> list[Any]:
        """The items of an array."""
        value = self.get(key)
        if not isinstance(value, list):
            raise self._error(f"{self.where}: {key}: expected an array")
        return value

    def text(self, key: str, expected: str = "a non-empty string") -> str:
        """A non-empty string; `expected` says in words what it stands for."""
        value = self.get(key)
        if not isinstance(value, str) or not value:
            raise self._refusal(key, expected, value)
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """An array of strings."""
        value = self.items(key)
        if not all(isinstance(item, str) for item in value):
            raise self._refusal(key, "an array of strings", value)
        return tuple(value)

    def choice(self, key: str, among: tuple[str, ...], default: str | None = None) -> str:
        """One of a few words."""
        value = self.get(key) if default is None else self._raw.get(key, default)
        if value not in among:
            raise self._refusal(key, f"one of {', '.join(among)}", value)
        return str(value)

    def whole(self, key: str, default: int, most: int | None = None) -> int:
        """A whole number >= 0, at most `most`."""
        value = self._raw.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < 0 or (most is not None and value > most):
            limit = "0 or more" if most is None else f"0 or more, at most {most}"
            raise self._refusal(key, f"a whole number of {limit}", value)
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
            raise self._refusal(key, expected, value)
        return float(value)

    def within(self, key: str, low: float, high: float, *, whole: bool = False) -> float:
        """A number from `low` to `high`; an int when it has to be `whole`."""
        value = self.get(key)
        if not is_within(value, low, high, whole=whole):
            raise self._refusal(key, span(low, high, whole=whole), value)
        return value if whole else float(value)

    def numbers(self, key: str) -> tuple[float, ...]:
        """An array of finite numbers."""
        value = self.items(key)
        if not all(is_number(item) for item in value):
            raise self._refusal(key, "an array of finite numbers", value)
        return tuple(float(item) for item in value)

    def matrix(self, key: str) -> tuple[tuple[float, ...], ...]:
        """An array of equally long rows of finite numbers."""
        rows = self.items(key)
        if not all(isinstance(row, list) and all(is_number(item) for item in row) for row in rows):
            raise self._error(f"{self.where}: {key}: expected rows of finite numbers")
        if len({len(row) for row in rows}) > 1:
            raise self._error(f"{self.where}: {key}: expected rows of equal length")
        return tuple(tuple(float(item) for item in row) for row in rows)

    def _refusal(self, key: str, expected: str, value: object) -> InputError:
        return self._error(f"{self.where}: {key}: expected {expected}, got {shown(value)}")


def is_within(value: object, low: float, high: float, *, whole: bool = False) -> bool:
    """Whether TOML gave a number of that range."""
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
        return False
    return low <= value <= high


def span(low: float, high: float, *, whole: bool = False) -> str:
    """What `is_within` asks for, in words."""
    return f"{'a whole number' if whole else 'a number'} from {low:g} to {high:g}"


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

"""A campaign file and the options beside it, checked: TOML to `Campaign`; errors name file, key and expectation."""

import re
from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from dob_companion.artifact import check_flyable, loads
from dob_companion.companion.parameters import PARAMETERS, fits
from dob_companion.errors import InputError as CompanionInputError
from sitl.campaign.plan import Between, Campaign, Values
from sitl.constants import DT
from sitl.errors import InputError
from sitl.scenario import tables
from sitl.scenario.spec import AIRFRAMES, load

LONGEST_DELAY = 20
"""Samples of link delay, as for `python -m sitl --delay`."""


def read(path: Path | None, options: Mapping[str, Any]) -> Campaign:
    """A campaign from a TOML file, options winning over it; what they name is found relative to the one that names it.

    Raises InputError, one line that names file or option, key, and what was expected.
    """
    content: dict[str, Any] = {}
    if path is not None:
        content = tables.read(path, InputError)
    return checked(content, path, options)


def checked(content: Mapping[str, Any], path: Path | None, options: Mapping[str, Any]) -> Campaign:
    """A campaign from what a file at `path` holds, as `read` does it."""
    for key in content:
        if key not in KEYS:
            hint = tables.nearest(key, list(KEYS)) or f"known: {', '.join(KEYS)}"
            raise InputError(f"{path}: {key}: unknown key; {hint}")
    values = {}
    for key, (default, check) in KEYS.items():
        optional = path is None or options.get(key) is not None
        base = Path() if optional or path is None else path.parent
        value = options.get(key)
        found = content.get(key, default) if value is None else value
        values[key] = check(_where(key, path, options), base, found)
    if not values["airframes"]:
        values["airframes"] = (load(values["scenario"]).airframe,)
    if values["wind_m_s"] and "linear" in values["airframes"]:
        raise InputError(f"{_where('wind_m_s', path, options)}: the linear airframe feels no wind; expected tailsitter")
    return Campaign(**values)


def _where(key: str, path: Path | None, options: Mapping[str, Any]) -> str:
    """How an error begins: with the option, or with file and key."""
    optional = path is None or options.get(key) is not None
    return f"--{key.replace('_', '-')}" if optional else f"{path}: {key}"


def _scenario(where: str, base: Path, value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise InputError(f"{where}: expected the name of a scenario or the path of a .toml file")
    return str(base / value) if value.endswith(".toml") or "/" in value else value


def _designs(where: str, base: Path, value: Any) -> dict[str, str]:
    if not isinstance(value, list) or not value or not all(isinstance(v, str) and v for v in value):
        raise InputError(f"{where}: expected at least one design.json, as FILE or NAME=FILE")
    designs: dict[str, str] = {}
    for item in value:
        name, equals, file = item.rpartition("=")
        path = base / file
        name = name if equals else path.stem
        if not re.fullmatch(r"[\w.+-]+", name):
            raise InputError(f"{where}: a design is called {name!r}; expected letters, digits and . _ + - only")
        if name in designs:
            raise InputError(f"{where}: two designs are called {name!r}; expected NAME=FILE with different names")
        designs[name] = _design(path)
    return designs


def _design(path: Path) -> str:
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as UTF-8 text: {error}") from None
    try:
        check_flyable(loads(text, str(path)), 1.0 / DT, str(path))
    except CompanionInputError as error:
        raise InputError(str(error)) from None
    return text


def _whole(low: int, high: int) -> Callable[[str, Path, Any], int]:
    def check(where: str, _: Path, value: Any) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise InputError(f"{where}: is {value!r}, expected a whole number from {low} to {high}")
        return value

    return check


def _several(what: str, fits: Callable[[Any], bool]) -> Callable[[str, Path, Any], tuple[Any, ...]]:
    def check(where: str, _: Path, value: Any) -> tuple[Any, ...]:
        found = value if isinstance(value, list) else [] if value is None else [value]
        if (value is not None and not found) or not all(fits(v) for v in found) or len(set(found)) != len(found):
            raise InputError(f"{where}: is {value!r}, expected {what}")
        return tuple(found)

    return check


def _number(value: Any, low: float, high: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value) and low <= value <= high


def _numbers(low: float, high: float) -> Callable[[str, Path, Any], Values]:
    def check(where: str, _: Path, value: Any) -> Values:
        if isinstance(value, dict) and set(value) == {"from", "to"}:
            ends = value["from"], value["to"]
            if all(_number(v, low, high) for v in ends) and ends[0] < ends[1]:
                return Between(float(ends[0]), float(ends[1]))
        found = value if isinstance(value, list) else [] if value is None else [value]
        if (
            (value is not None and not found)
            or not all(_number(v, low, high) for v in found)
            or len(set(found)) != len(found)
        ):
            kind = "different numbers, or { from = …, to = … },"
            raise InputError(f"{where}: is {value!r}, expected {kind} from {low:g} to {high:g}")
        return tuple(map(float, found))

    return check


def _parameters(where: str, _: Path, value: Any) -> dict[str, float]:
    """Start values of the companion's parameters, checked by the companion's own table."""
    if not isinstance(value, dict):
        raise InputError(f"{where}: expected a table of the companion's parameters")
    specs = {spec.name: spec for spec in PARAMETERS if not spec.read_only and spec.name != "DOB_ENABLE"}
    for name, number in value.items():
        spec = specs.get(name)
        if spec is None:
            raise InputError(f"{where}.{name}: unknown; expected one of {', '.join(specs)}")
        if not _number(number, spec.low, spec.high) or not fits(spec, float(number)):
            kind = "a whole number" if spec.whole else "a number"
            raise InputError(f"{where}.{name}: is {number!r}, expected {kind} from {spec.low:g} to {spec.high:g}")
    return {name: float(number) for name, number in value.items()}


KEYS: dict[str, tuple[Any, Callable[[str, Path, Any], Any]]] = {
    "scenario": ("paper", _scenario),
    "designs": (None, _designs),
    "seeds": (100, _whole(1, 10_000_000)),
    "first_seed": (1, _whole(0, 2**32 - 1)),
    "airframes": (None, _several(f"different ones of {', '.join(AIRFRAMES)}", lambda v: v in AIRFRAMES)),
    "delays": (
        1,
        _several(
            f"different whole numbers from 0 to {LONGEST_DELAY}",
            lambda v: isinstance(v, int) and not isinstance(v, bool) and 0 <= v <= LONGEST_DELAY,
        ),
    ),
    "gain": (1.0, _numbers(0.05, 20.0)),
    "pole": (1.0, _numbers(0.05, 20.0)),
    "wind_m_s": (None, _numbers(0.0, 30.0)),
    "parameters": ({}, _parameters),
}
"""Every key of a campaign file with its default and its check; the options have the same names."""

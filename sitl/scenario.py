"""Scenario files: TOML to frozen dataclasses, with errors that name file, key and what was expected."""

import tomllib
from dataclasses import dataclass
from difflib import get_close_matches
from math import isfinite
from pathlib import Path
from typing import Any

from sitl.attitude import Vector
from sitl.errors import ScenarioError

AXES = ("roll", "pitch", "yaw")

_PACKAGED = Path(__file__).parent / "scenarios"


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Torque disturbance: low-pass bandwidth in Hz, and the attitude error peaks (rad) it causes with no observer."""

    bandwidth_hz: float
    peak_attitude_error: Vector


@dataclass(frozen=True, slots=True)
class Windows:
    """Two equally long windows, observer off and on, each preceded by a lead that is left out; s.

    Before the second lead there are `settle_s` of still air, so that both segments begin from the same rest.
    """

    lead_s: float
    length_s: float
    settle_s: float


@dataclass(frozen=True, slots=True)
class Scenario:
    """What is flown. Without `windows` it hovers until stopped; `windows` and `disturbance` come together."""

    name: str
    title: str
    hover_altitude: float
    noise_dbw: float
    disturbance: Disturbance | None = None
    windows: Windows | None = None
    paper_ratio: Vector | None = None


def packaged_names() -> list[str]:
    """Names of the scenarios that come with the package."""
    return sorted(path.stem for path in _PACKAGED.glob("*.toml"))


def load(name_or_path: str) -> Scenario:
    """Load a packaged scenario by name, or any by path (what ends in .toml or holds a slash is a path).

    Raises ScenarioError.
    """
    if name_or_path.endswith(".toml") or "/" in name_or_path:
        return _read(Path(name_or_path))
    names = packaged_names()
    if name_or_path not in names:
        hint = _nearest(name_or_path, names) or f"known: {', '.join(names)}"
        raise ScenarioError(f"scenario {name_or_path!r} is unknown; {hint}; or give the path of a .toml file")
    return _read(_PACKAGED / f"{name_or_path}.toml")


def _read(path: Path) -> Scenario:
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: cannot be read as UTF-8 text: {error}") from None
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{path}: not TOML: {error}") from None
    return _scenario(_Table(str(path), "", table), path.stem)


def _scenario(top: "_Table", name: str) -> Scenario:
    gyro = top.table("gyro")
    disturbance, windows, ratio = (top.optional_table(k) for k in ("disturbance", "windows", "paper_ratio"))
    scenario = Scenario(
        name=name,
        title=top.text("title"),
        hover_altitude=top.number("hover_altitude_m", 1.0, 100.0),
        noise_dbw=gyro.number("noise_dbw", -300.0, 0.0),
        disturbance=_disturbance(disturbance) if disturbance else None,
        windows=_windows(windows) if windows else None,
        paper_ratio=ratio.axes(0.0, 1e6) if ratio else None,
    )
    top.finish()
    gyro.finish()
    if (scenario.disturbance is None) != (scenario.windows is None):
        raise ScenarioError(f"{top.file}: [disturbance] and [windows] come together, or neither")
    return scenario


def _disturbance(table: "_Table") -> Disturbance:
    peaks = table.table("peak_attitude_error_rad")
    result = Disturbance(table.number("bandwidth_hz", 1e-3, 100.0), peaks.axes(1e-4, 1.0))
    table.finish()
    return result


def _windows(table: "_Table") -> Windows:
    result = Windows(
        lead_s=table.number("lead_s", 0.0, 600.0),
        length_s=table.number("length_s", 0.1, 3600.0),
        settle_s=table.number("settle_s", 0.0, 600.0),
    )
    table.finish()
    return result


class _Table:
    """One TOML table whose keys are taken out one by one; `finish` complains about those nobody asked for."""

    def __init__(self, file: str, name: str, content: dict[str, Any]) -> None:
        self.file, self._name, self._left = file, name, dict(content)
        self._known: list[str] = []

    def _where(self, key: str) -> str:
        return f"{self.file}: {self._name}.{key}" if self._name else f"{self.file}: {key}"

    def _take(self, key: str) -> Any:
        self._known.append(key)
        return self._left.pop(key, None)

    def text(self, key: str) -> str:
        value = self._take(key)
        if not isinstance(value, str):
            raise ScenarioError(f"{self._where(key)}: expected text{self._instead(key)}")
        return value

    def number(self, key: str, low: float, high: float) -> float:
        value = self._take(key)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not isfinite(value) or not low <= value <= high:
            raise ScenarioError(f"{self._where(key)}: expected a number from {low:g} to {high:g}{self._instead(key)}")
        return float(value)

    def axes(self, low: float, high: float) -> Vector:
        roll, pitch, yaw = (self.number(axis, low, high) for axis in AXES)
        self.finish()
        return roll, pitch, yaw

    def table(self, key: str) -> "_Table":
        table = self.optional_table(key)
        if table is None:
            raise ScenarioError(f"{self._where(key)}: expected a table{self._instead(key)}")
        return table

    def optional_table(self, key: str) -> "_Table | None":
        value = self._take(key)
        if value is None:
            return None
        if not isinstance(value, dict):
            raise ScenarioError(f"{self._where(key)}: expected a table")
        return _Table(self.file, f"{self._name}.{key}".lstrip("."), value)

    def _instead(self, key: str) -> str:
        """A hint where a missing key stands in the file under a misspelt name."""
        close = get_close_matches(key, self._left, 1)
        return f"; {close[0]!r} is unknown, did you mean {key!r}?" if close else ""

    def finish(self) -> None:
        for key in self._left:
            hint = _nearest(key, self._known) or f"known: {', '.join(self._known)}"
            raise ScenarioError(f"{self._where(key)}: unknown key; {hint}")


def _nearest(word: str, known: list[str]) -> str:
    close = get_close_matches(word, known, 1, cutoff=0.5)
    return f"did you mean {close[0]!r}?" if close else ""

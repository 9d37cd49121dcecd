"""Parameters of an autopilot, and the files in which ground stations keep them."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from dob_companion.errors import InputError

AUTOPILOT = "1"
"""MAV_COMP_ID_AUTOPILOT1, as QGroundControl writes it."""

_NAME = re.compile(r"[A-Z][A-Z0-9_]{0,15}")
_BETWEEN = re.compile(r"[,\s=]+")


@dataclass(frozen=True, slots=True)
class Parameters:
    """Values by name; `source` is the file or link that they come from, for messages."""

    source: str
    values: Mapping[str, float]

    def need(self, name: str) -> float:
        """The value. Raises InputError, one line that names the parameter, where there is none or it is below 0."""
        if name not in self.values:
            raise InputError(f"{self.source}: parameter {name} is missing")
        return self.get(name)

    def get(self, name: str, default: float = 0.0) -> float:
        """The value, or `default` where this autopilot has no such parameter. Raises InputError where it is below 0."""
        value = self.values.get(name, default)
        if value < 0.0:
            raise InputError(f"{self.source}: parameter {name} is {value:g}, expected a number of 0 or more")
        return value

    def positive(self, name: str) -> float:
        """As `need`, and above 0."""
        value = self.need(name)
        if value == 0.0:
            raise InputError(f"{self.source}: parameter {name} is 0, expected a number above 0")
        return value

    def said(self, name: str) -> str:
        """Name = value, for a comment; "" where it is not there."""
        return f"{name} = {self.values[name]:g}" if name in self.values else ""


def single(value: float) -> float:
    """The shortest decimal that is this number in single precision, which is what autopilots keep."""
    return float(str(np.float32(value)))


def parse_parameters(text: str, source: str) -> Parameters:
    """Read a parameter file: a line holds NAME,VALUE (Mission Planner) or NAME VALUE (MAVProxy), or vehicle, component,
    name, value and type between tabs (QGroundControl). What follows a value or a # is a comment.

    Raises InputError, one line that names the file and the line or the parameter.
    """
    values: dict[str, float] = {}
    vehicles: set[str] = set()
    for where, name, word, vehicle in _rows(text, source):
        try:
            value = single(float(word))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(f"{where}: parameter {name} is {word!r}, expected a finite number")
        if values.setdefault(name, value) != value:
            raise InputError(f"{where}: parameter {name} is {values[name]:g} and {value:g} in one file")
        vehicles.add(vehicle)
    if len(vehicles) > 1:
        raise InputError(f"{source}: parameters of several vehicles ({', '.join(sorted(vehicles))}); expected one")
    if not values:
        raise InputError(f"{source}: no parameters in it; expected lines of NAME,VALUE")
    return Parameters(source, values)


def _rows(text: str, source: str) -> Iterator[tuple[str, str, str, str]]:
    """Place, name, value as written, vehicle ("" where the file does not say) of each line that holds a parameter."""
    for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1):
        words = _BETWEEN.split(line.partition("#")[0].strip())
        if words == [""]:
            continue
        vehicle = ""
        if words[0].isdigit():
            vehicle, component, *words = [*words, ""]
            if component != AUTOPILOT:  # a camera's, or the companion's own
                continue
        where = f"{source}: line {number}"
        if len(words) < 2 or not _NAME.fullmatch(words[0]):
            raise InputError(f"{where}: expected NAME,VALUE, got {line.strip()[:40]!r}")
        yield where, words[0], words[1], vehicle

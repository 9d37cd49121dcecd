"""The parameters that a ground station sees, their ranges, and how a write is read."""

from collections.abc import Mapping
from dataclasses import dataclass

from dob_companion.artifact import AXES, DobDesign
from dob_companion.mavlink import ParamRefusal, ParamWrite
from dob_companion.supervisor import State

UNKNOWN_LIMIT = 0.3
"""DOB_LIMIT where neither the operator, nor the configuration, nor the design says one; normalized torque."""


@dataclass(frozen=True, slots=True)
class ParameterSpec:
    """One row of the table. Everything travels as REAL32; `whole` numbers may be written in any integer coding.

    What the operator writes to a `kept` one survives a restart. `unit` is "" for what has none.
    """

    name: str
    meaning: str
    default: float
    low: float
    high: float
    whole: bool = False
    read_only: bool = False
    kept: bool = True
    unit: str = ""


PARAMETERS: tuple[ParameterSpec, ...] = (
    ParameterSpec("DOB_ENABLE", "inject; 0 clears a fault", 0, 0, 1, whole=True, kept=False),
    ParameterSpec("DOB_AXES", "1 roll, 2 pitch, 4 yaw, added up", 7, 0, 7, whole=True),
    ParameterSpec("DOB_GAIN", "gain g on the estimate", 1, 0, 1),
    ParameterSpec("DOB_LIMIT", "largest correction of an axis", UNKNOWN_LIMIT, 0, 1, unit="normalized torque"),
    ParameterSpec("DOB_RAMP_S", "fade-in and fade-out time", 0.5, 0, 10, unit="s"),
    ParameterSpec("DOB_STATE", "what the supervisor does", 0, 0, 6, whole=True, read_only=True, kept=False),
)

_SMALLEST_NORMAL = 1.1754943508222875e-38
"""FLT_MIN of IEEE 754 single precision."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What the parameters ask of the loop. Axes are roll, pitch, yaw; limit in normalized torque, ramp in s."""

    enable: bool
    axes: tuple[bool, bool, bool]
    gain: float
    limit: float
    ramp_s: float

    @classmethod
    def of(cls, values: Mapping[str, float]) -> "Settings":
        """The values of the table, by name."""
        bits = int(values["DOB_AXES"])
        return cls(
            values["DOB_ENABLE"] == 1.0,
            (bool(bits & 1), bool(bits & 2), bool(bits & 4)),
            values["DOB_GAIN"],
            values["DOB_LIMIT"],
            values["DOB_RAMP_S"],
        )


_INDEX = {spec.name: index for index, spec in enumerate(PARAMETERS)}


class Parameters:
    """The values behind the table. The list is frozen: its order gives the indices on the wire.

    `initial` goes before the table's defaults, and before the limit that a design has of its own, where one is given.
    """

    def __init__(self, initial: Mapping[str, float] | None = None, limit: float | None = None) -> None:
        self._values = {spec.name: float(spec.default) for spec in PARAMETERS}
        self._values |= ({} if limit is None else {"DOB_LIMIT": limit}) | dict(initial or {})
        self.settings = Settings.of(self._values)
        self.written: Mapping[str, float] = {}
        """What the operator has set and a restart should find again: a new mapping at each write."""

    def __len__(self) -> int:
        return len(PARAMETERS)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def publish_state(self, state: int) -> None:
        """Set the read-only DOB_STATE."""
        self._values["DOB_STATE"] = float(state)

    def switch_off(self) -> None:
        """Take the operator's wish back: it was meant for another vehicle."""
        self._values["DOB_ENABLE"] = 0.0
        self.settings = Settings.of(self._values)

    def find(self, name: str, index: int | None) -> int | None:
        """Index of a parameter asked for by name or by index; None when there is none."""
        if index is not None:
            return index if index < len(PARAMETERS) else None
        return _INDEX.get(name)

    def write(self, write: ParamWrite) -> ParamRefusal | None:
        """Take a write; None when taken, else why not. A refused write changes nothing."""
        index = _INDEX.get(write.name)
        if index is None:
            return ParamRefusal.DOES_NOT_EXIST
        spec = PARAMETERS[index]
        if spec.read_only:
            return ParamRefusal.READ_ONLY
        value = _lenient(spec, write)
        if not fits(spec, value):
            return ParamRefusal.VALUE_OUT_OF_RANGE
        self._values[spec.name] = value
        self.settings = Settings.of(self._values)
        if spec.kept:
            self.written = {**self.written, spec.name: value}
        return None


def fits(spec: ParameterSpec, value: float) -> bool:
    """Whether a value is finite, in range, and whole where that is meant."""
    return spec.low <= value <= spec.high and (not spec.whole or value == round(value))


def in_words(name: str, value: float) -> str:
    """What a value means beside its number: a unit, a state's name, the axes of the mask. "" when nothing is to add."""
    spec = PARAMETERS[_INDEX[name]] if name in _INDEX else None
    if spec is None or not fits(spec, value):
        return ""
    match name:
        case "DOB_ENABLE":
            return "on" if value else "off"
        case "DOB_AXES":
            return ", ".join(axis for bit, axis in enumerate(AXES) if int(value) >> bit & 1) or "none"
        case "DOB_STATE":
            return State(int(value)).name
    return spec.unit


def limits_in_words(design: DobDesign, limit: float) -> str:
    """What a correction may be at most, and what the design says of it; `limit` is DOB_LIMIT."""
    if design.limit is None:
        return f"DOB_LIMIT {limit:g}: the design does not say what disturbance it is for"
    if abs(limit - design.limit) <= 1e-6:
        return f"DOB_LIMIT {limit:g}: the largest disturbance that the design is for"
    return f"DOB_LIMIT {limit:g}: the design is for disturbances of {design.limit:g} at most"


def _lenient(spec: ParameterSpec, write: ParamWrite) -> float:
    """The value meant. Ground stations disagree on whether an integer travels by value or byte by byte; a small
    integer sent byte by byte reads as a denormal real number (1 as 1.4e-45), which nobody means."""
    if write.bytewise is not None and (abs(write.value) < _SMALLEST_NORMAL or not fits(spec, write.value)):
        return float(write.bytewise)
    return write.value

"""The daemon's configuration: what is fixed for a run, as TOML text to a checked value."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from itertools import pairwise
from typing import Any

from dob_companion import toml
from dob_companion.companion.parameters import PARAMETERS, fits
from dob_companion.errors import ConfigError
from dob_companion.mavlink import CORRECTION_MESSAGES, profiles
from dob_companion.mavlink.axes import IN_HOVER, AxisMap, VehicleAxes, axis_map
from dob_companion.supervisor import FirstEnabling, RegimeLimits

REGIME_RANGES = {"throttle_floor": (0.0, 1.0, False), "kill_channel": (0, 18, True), "kill_above": (800, 2200, True)}
AXES_KEYS = ("gyro", "moment")
FIRST_RANGES = {"seconds": (0.1, 60.0, False)}
RECORD_RANGES = {"mb": (0.1, 1e6, False), "segments": (2, 1_000_000, True)}
"""Least and greatest value of a number, and whether it is whole. One segment is being written, so two are the least."""


@dataclass(frozen=True, slots=True)
class Recording:
    """Where flights are recorded, and how much is kept: `segments` of `mb` megabytes, trace and .tlog together.

    dir None records nothing. Raises ConfigError for sizes that cannot be kept.
    """

    dir: str | None = None
    mb: float = 64.0
    segments: int = 16

    def __post_init__(self) -> None:
        given = toml.Table("record", {key: getattr(self, key) for key in RECORD_RANGES}, None, ConfigError)
        _numbers(given, RECORD_RANGES)


@dataclass(frozen=True, slots=True, kw_only=True)
class CompanionConfig:
    """Settings of one run.

    system              the vehicle's MAVLink system id, 1…255; None takes the first autopilot heard
    profile             where the inputs come from: a profile's name, or "auto", by the make of the autopilot
    axes                in which axes the vehicle speaks, where they are not those of hover
    correction_message  which message carries the correction; None is the profile's own
    parameters          start values that differ from the table's defaults
    state_directory     where the operator's settings are kept; None keeps nothing
    signing_key_file    the key of MAVLink 2 signing; None means that nothing is signed or checked
    regime              when the aircraft counts as flying, and the kill switch
    first_enabling      how a correction is faded in that has not yet been carried in a flight
    record              where flights are recorded, and how much is kept
    """

    system: int | None = None
    profile: str = profiles.AUTO
    axes: VehicleAxes = IN_HOVER
    correction_message: str | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    state_directory: str | None = None
    signing_key_file: str | None = None
    regime: RegimeLimits = field(default_factory=RegimeLimits)
    first_enabling: FirstEnabling = field(default_factory=FirstEnabling)
    record: Recording = field(default_factory=Recording)


def parse_config(text: str, source: str) -> CompanionConfig:
    """Read a configuration. Raises ConfigError, one line that names `source` and the key."""
    known = [key.name for key in fields(CompanionConfig)]
    table = toml.Table(source, toml.read(text, source, ConfigError), known, ConfigError)
    return CompanionConfig(
        system=int(table.within("system", 1, 255, whole=True)) if "system" in table else None,
        profile=table.choice("profile", profiles.NAMES, profiles.AUTO),
        axes=_axes(table.table("axes", AXES_KEYS)) if "axes" in table else IN_HOVER,
        correction_message=_message(table),
        parameters=_parameters(table.open("parameters")) if "parameters" in table else {},
        state_directory=_path(table, "state_directory"),
        signing_key_file=_path(table, "signing_key_file"),
        regime=RegimeLimits(
            **_numbers(table.table("regime", REGIME_RANGES), REGIME_RANGES) if "regime" in table else {}
        ),
        first_enabling=_first_enabling(table.table("first_enabling", ("shares", *FIRST_RANGES)))
        if "first_enabling" in table
        else FirstEnabling(),
        record=_recording(table.table("record", ("dir", *RECORD_RANGES))) if "record" in table else Recording(),
    )


def _axes(table: toml.Table) -> VehicleAxes:
    return VehicleAxes(**{key: _axis_map(table, key) for key in AXES_KEYS if key in table})


def _axis_map(table: toml.Table, key: str) -> AxisMap:
    try:
        return axis_map(table.texts(key))
    except ValueError as problem:
        raise ConfigError(f"{table.where}: {key}: {problem}") from None


def _message(table: toml.Table) -> str | None:
    return table.choice("correction_message", CORRECTION_MESSAGES) if "correction_message" in table else None


def _path(table: toml.Table, key: str) -> str | None:
    return table.text(key, "a path") if key in table else None


def _recording(table: toml.Table) -> Recording:
    return Recording(_path(table, "dir"), **_numbers(table, RECORD_RANGES))


def _first_enabling(table: toml.Table) -> FirstEnabling:
    numbers = _numbers(table, FIRST_RANGES)
    if "shares" not in table:
        return FirstEnabling(**numbers)
    shares = table.numbers("shares")
    if not all(low < high for low, high in pairwise([0.0, *shares, 1.0])):
        raise ConfigError(f"{table.where}: shares: expected rising numbers between 0 and 1, got {list(shares)}")
    return FirstEnabling(shares, **numbers)


def _numbers(table: toml.Table, ranges: Mapping[str, tuple[float, float, bool]]) -> dict[str, Any]:
    return {
        key: table.within(key, low, high, whole=whole) for key, (low, high, whole) in ranges.items() if key in table
    }


def _parameters(table: toml.Table) -> dict[str, float]:
    specs = {spec.name: spec for spec in PARAMETERS if not spec.read_only}
    table.expect(specs)
    return {
        name: table.number(name, partial(fits, spec), toml.span(spec.low, spec.high, whole=spec.whole))
        for name, spec in specs.items()
        if name in table
    }

"""The daemon's configuration: what is fixed for a run, as TOML text to a checked value."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from dob_companion.companion.parameters import PARAMETERS, fits
from dob_companion.errors import ConfigError, unknown_key
from dob_companion.mavlink import CORRECTION_MESSAGES, profiles
from dob_companion.supervisor import RegimeLimits

REGIME_RANGES = {"throttle_floor": (0.0, 1.0, False), "kill_channel": (0, 18, True), "kill_above": (800, 2200, True)}
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
        for key, limits in RECORD_RANGES.items():
            _number(f"record.{key}", getattr(self, key), *limits)


@dataclass(frozen=True, slots=True)
class CompanionConfig:
    """Settings of one run.

    system              the vehicle's MAVLink system id, 1…255; None takes the first autopilot heard
    profile             where the inputs come from: a profile's name, or "auto", by the make of the autopilot
    correction_message  which message carries the correction; None is the profile's own
    parameters          start values that differ from the table's defaults
    state_directory     where the operator's settings are kept; None keeps nothing
    signing_key_file    the key of MAVLink 2 signing; None means that nothing is signed or checked
    regime              when the aircraft counts as flying, and the kill switch
    record              where flights are recorded, and how much is kept
    """

    system: int | None = None
    profile: str = profiles.AUTO
    correction_message: str | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    state_directory: str | None = None
    signing_key_file: str | None = None
    regime: RegimeLimits = field(default_factory=RegimeLimits)
    record: Recording = field(default_factory=Recording)


def parse_config(text: str, source: str) -> CompanionConfig:
    """Read a configuration. Raises ConfigError, one line that names `source` and the key."""
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as problem:
        raise ConfigError(f"{source}: not TOML: {problem}") from None
    _known(source, table, [key.name for key in fields(CompanionConfig)])
    system = table.get("system")
    if system is not None and not (type(system) is int and 1 <= system <= 255):
        raise ConfigError(f"{source}: system is {system!r}, expected a whole number from 1 to 255")
    profile = table.get("profile", profiles.AUTO)
    if profile not in profiles.NAMES:
        raise ConfigError(f"{source}: profile is {profile!r}, expected {' or '.join(profiles.NAMES)}")
    message = table.get("correction_message")
    if message is not None and message not in CORRECTION_MESSAGES:
        raise ConfigError(f"{source}: correction_message is {message!r}, expected {' or '.join(CORRECTION_MESSAGES)}")
    return CompanionConfig(
        system,
        profile,
        message,
        _parameters(source, table.get("parameters", {})),
        _path(source, table, "state_directory"),
        _path(source, table, "signing_key_file"),
        RegimeLimits(**_numbers(source, table, "regime", REGIME_RANGES)),
        _recording(source, table),
    )


def _path(source: str, table: Mapping[str, Any], key: str, prefix: str = "") -> str | None:
    path = table.get(key)
    if path is not None and not (isinstance(path, str) and path):
        raise ConfigError(f"{source}: {prefix}{key} is {path!r}, expected a path")
    return path


def _recording(source: str, table: Mapping[str, Any]) -> Recording:
    numbers = _numbers(source, table, "record", RECORD_RANGES, "dir")
    return Recording(_path(source, table.get("record", {}), "dir", "record."), **numbers)


def _numbers(
    source: str, table: Mapping[str, Any], name: str, ranges: Mapping[str, tuple[float, float, bool]], *others: str
) -> dict[str, Any]:
    """The numbers of the table `name`, which may hold `others` besides."""
    inner = table.get(name, {})
    if not isinstance(inner, dict):
        raise ConfigError(f"{source}: {name}: expected a table")
    _known(f"{source}: {name}", inner, (*ranges, *others))
    for key in ranges.keys() & inner.keys():
        _number(f"{source}: {name}.{key}", inner[key], *ranges[key])
    return {key: inner[key] for key in ranges if key in inner}


def _number(where: str, value: object, low: float, high: float, whole: bool) -> None:
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float) or not low <= value <= high:
        kind = "a whole number" if whole else "a number"
        raise ConfigError(f"{where} is {value!r}, expected {kind} from {low:g} to {high:g}")


def _parameters(source: str, table: Any) -> dict[str, float]:
    if not isinstance(table, dict):
        raise ConfigError(f"{source}: parameters: expected a table")
    specs = {spec.name: spec for spec in PARAMETERS if not spec.read_only}
    _known(f"{source}: parameters", table, specs)
    for name, value in table.items():
        spec = specs[name]
        if isinstance(value, bool) or not isinstance(value, int | float) or not fits(spec, value):
            kind = "a whole number" if spec.whole else "a number"
            raise ConfigError(
                f"{source}: parameters.{name} is {value!r}, expected {kind} from {spec.low:g} to {spec.high:g}"
            )
    return {name: float(value) for name, value in table.items()}


def _known(where: str, table: Mapping[str, Any], keys: Iterable[str]) -> None:
    for key in table:
        if key not in keys:
            raise ConfigError(f"{where}: {unknown_key(key, keys)}")

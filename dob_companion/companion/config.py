"""The daemon's configuration: what is fixed for a run, as TOML text to a checked value."""

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dob_companion.companion.parameters import PARAMETERS, fits
from dob_companion.errors import ConfigError
from dob_companion.mavlink import CORRECTION_MESSAGES
from dob_companion.supervisor import RegimeLimits

KEYS = ("system", "correction_message", "parameters", "state_directory", "signing_key_file", "regime")
REGIME_KEYS = ("throttle_floor", "kill_channel", "kill_above")


@dataclass(frozen=True, slots=True)
class CompanionConfig:
    """Settings of one run.

    system              the vehicle's MAVLink system id, 1…255; None takes the first autopilot heard
    correction_message  which message carries the correction
    parameters          start values that differ from the table's defaults
    state_directory     where the operator's settings are kept; None keeps nothing
    signing_key_file    the key of MAVLink 2 signing; None means that nothing is signed or checked
    regime              when the aircraft counts as flying, and the kill switch
    """

    system: int | None = None
    correction_message: str = CORRECTION_MESSAGES[0]
    parameters: Mapping[str, float] = field(default_factory=dict)
    state_directory: str | None = None
    signing_key_file: str | None = None
    regime: RegimeLimits = field(default_factory=RegimeLimits)


def parse_config(text: str, source: str) -> CompanionConfig:
    """Read a configuration. Raises ConfigError, one line that names `source` and the key."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise ConfigError(f"{source}: not TOML: {problem}") from None
    _known(source, "", table, KEYS)
    system = table.get("system")
    if system is not None and not (type(system) is int and 1 <= system <= 255):
        raise ConfigError(f"{source}: system is {system!r}, expected a whole number from 1 to 255")
    message = table.get("correction_message", CORRECTION_MESSAGES[0])
    if message not in CORRECTION_MESSAGES:
        raise ConfigError(f"{source}: correction_message is {message!r}, expected {' or '.join(CORRECTION_MESSAGES)}")
    return CompanionConfig(
        system,
        message,
        _parameters(source, table.get("parameters", {})),
        _path(source, table, "state_directory"),
        _path(source, table, "signing_key_file"),
        _regime(source, table),
    )


def _path(source: str, table: Mapping[str, Any], key: str) -> str | None:
    path = table.get(key)
    if path is not None and not (isinstance(path, str) and path):
        raise ConfigError(f"{source}: {key} is {path!r}, expected a path")
    return path


def _regime(source: str, table: Mapping[str, Any]) -> RegimeLimits:
    regime = table.get("regime", {})
    if not isinstance(regime, dict):
        raise ConfigError(f"{source}: regime: expected a table")
    _known(source, "regime.", regime, REGIME_KEYS)
    limits = {"throttle_floor": (0.0, 1.0, False), "kill_channel": (0, 18, True), "kill_above": (800, 2200, True)}
    for key, value in regime.items():
        low, high, whole = limits[key]
        if isinstance(value, bool) or not isinstance(value, int if whole else int | float) or not low <= value <= high:
            kind = "a whole number" if whole else "a number"
            raise ConfigError(f"{source}: regime.{key} is {value!r}, expected {kind} from {low:g} to {high:g}")
    return RegimeLimits(**regime)


def _parameters(source: str, table: Any) -> dict[str, float]:
    if not isinstance(table, dict):
        raise ConfigError(f"{source}: parameters: expected a table")
    specs = {spec.name: spec for spec in PARAMETERS if not spec.read_only}
    _known(source, "parameters.", table, tuple(specs))
    for name, value in table.items():
        spec = specs[name]
        if isinstance(value, bool) or not isinstance(value, int | float) or not fits(spec, value):
            kind = "a whole number" if spec.whole else "a number"
            raise ConfigError(
                f"{source}: parameters.{name} is {value!r}, expected {kind} from {spec.low:g} to {spec.high:g}"
            )
    return {name: float(value) for name, value in table.items()}


def _known(source: str, prefix: str, table: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    for key in table:
        if key not in keys:
            nearest = difflib.get_close_matches(key, keys, n=1, cutoff=0.0)
            raise ConfigError(f"{source}: unknown key {prefix}{key}; nearest is {prefix}{nearest[0]}")

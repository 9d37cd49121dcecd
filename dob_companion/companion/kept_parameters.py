"""What the operator has set, as text that a restart reads again. Pure; the disk is `files.parameter_keeper`."""

import json
from collections.abc import Mapping

from dob_companion.artifact import sha256_of
from dob_companion.companion.parameters import PARAMETERS, fits
from dob_companion.errors import ConfigError

SCHEMA = "dob-companion/parameters/1"

_KEPT = {spec.name: spec for spec in PARAMETERS if spec.kept}


def dump_parameters(values: Mapping[str, float]) -> str:
    """Parameter values as JSON text, sealed with a hash so that a damaged file cannot pass for a whole one."""
    obj = {"schema": SCHEMA, "values": dict(values)}
    return json.dumps(obj | {"sha256": sha256_of(obj)}, indent=1) + "\n"


def load_parameters(text: str, source: str) -> dict[str, float]:
    """Read what `dump_parameters` wrote. Raises ConfigError, one line that names `source`, for anything else.

    A name or value that this version does not know spoils the whole file: half an operator's settings may be a
    combination that nobody chose.
    """
    try:
        obj = json.loads(text)
        whole = obj["schema"] == SCHEMA and obj["sha256"] == sha256_of(obj)
        values = {name: float(value) for name, value in obj["values"].items()}
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        raise ConfigError(f"{source}: damaged; expected {SCHEMA}") from None
    if not whole:
        raise ConfigError(f"{source}: schema or sha256 does not match; expected {SCHEMA}")
    for name, value in values.items():
        if name not in _KEPT or not fits(_KEPT[name], value):
            raise ConfigError(f"{source}: {name} = {value:g} is no setting that can be kept")
    return values

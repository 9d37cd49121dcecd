"""deploy/dob-companion.toml shows every key, and shows it right."""

import dataclasses
import re
import tomllib
from pathlib import Path

from dob_companion.companion import PARAMETERS, CompanionConfig, parse_config
from dob_companion.mavlink import profiles

EXAMPLE = Path(__file__).parents[2] / "deploy" / "dob-companion.toml"
WITHOUT_DEFAULT = {"system", "correction_message", "state_directory", "signing_key_file"}
"""Keys whose absence means something, so that the example shows an example instead."""


def uncommented():
    return re.sub(r"^#(?=[\[\w])", "", EXAMPLE.read_text(), flags=re.MULTILINE)


def known_keys():
    """Every key of the configuration, tables with their own."""
    default = CompanionConfig()
    keys = {}
    for field in dataclasses.fields(default):
        value = getattr(default, field.name)
        keys[field.name] = (
            {inner.name for inner in dataclasses.fields(value)} if dataclasses.is_dataclass(value) else None
        )
    keys["parameters"] = {spec.name for spec in PARAMETERS if not spec.read_only}
    return keys


def test_the_example_as_it_stands_changes_nothing():
    assert parse_config(EXAMPLE.read_text(), "example") == CompanionConfig()


def test_every_key_is_shown_and_no_other():
    table = tomllib.loads(uncommented())
    assert {key: set(value) if isinstance(value, dict) else None for key, value in table.items()} == known_keys()


def test_the_values_shown_are_the_defaults():
    shown, default = parse_config(uncommented(), "example"), CompanionConfig()
    shown = dataclasses.replace(shown, record=dataclasses.replace(shown.record, dir=None))
    for field in dataclasses.fields(default):
        if field.name not in WITHOUT_DEFAULT | {"parameters"}:
            assert getattr(shown, field.name) == getattr(default, field.name), field.name
    assert shown.correction_message == profiles.FALLBACK.carrier
    assert shown.parameters == {spec.name: spec.default for spec in PARAMETERS if not spec.read_only}

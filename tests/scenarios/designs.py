"""Observers for the scenarios: the tuned example specs, one for each link delay."""

from functools import cache
from pathlib import Path

from dob_companion.artifact import DobDesign, dumps
from dob_companion.synthesis import design_from_toml
from docs.shipped import EXAMPLES, SPECS


@cache
def design_for(delay: int) -> DobDesign:
    """The observer designed for this link delay in samples."""
    return design_named(SPECS[delay])


@cache
def design_named(spec: str) -> DobDesign:
    """The observer of an example spec, by the file's name."""
    return design_from_toml((EXAMPLES / spec).read_text(encoding="utf-8"))


def design_file(directory: Path, delay: int) -> Path:
    """Its design.json, written into a directory."""
    path = directory / f"design-{delay}.json"
    path.write_text(dumps(design_for(delay))[0], "utf-8")
    return path

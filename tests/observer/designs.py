"""Designs of every kind for tests of the observer: the paper's, a tuned one, and one flown on an ArduPilot copter."""

from functools import cache
from pathlib import Path

from dob_companion.artifact import loads
from dob_companion.synthesis import design, parse_spec

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"
FLOWN = HERE.parent / "data" / "ardupilot" / "copter_irregular.design.json"


@cache
def designed(name):
    """`paper`, `tuned` or `ardupilot`."""
    if name == "ardupilot":
        return loads(FLOWN.read_text(), FLOWN.name)
    return design(parse_spec((EXAMPLES / f"tailsitter_{name}.toml").read_text(), name))

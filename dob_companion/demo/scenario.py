"""What the simulated vehicle is asked to fly: it says itself what a scenario is."""

import json
import subprocess
import sys
from dataclasses import dataclass

from dob_companion.errors import InputError


@dataclass(frozen=True, slots=True)
class Scenario:
    """A scenario as `python -m sitl NAME --about` tells it. `asked` is the name or the path by which it is flown."""

    asked: str
    title: str
    seconds: float
    checks: int


def scenario_of(asked: str) -> Scenario:
    """Ask the vehicle. Raises InputError for one that it does not know, or that has no off and on to compare."""
    told = subprocess.run(
        [sys.executable, "-m", "sitl", "--about", "--", asked], capture_output=True, text=True, check=False
    )
    if told.returncode:
        words = told.stderr.strip().splitlines()
        raise InputError(words[-1].removeprefix("sitl: ") if words else f"scenario {asked}: the vehicle says nothing")
    about = json.loads(told.stdout)
    if about["seconds"] is None:
        raise InputError(
            f"scenario {asked} has no windows, so there is no off and on to compare; it is flown by hand: "
            f"python -m sitl {asked}"
        )
    return Scenario(asked, about["title"], about["seconds"], about["checks"])

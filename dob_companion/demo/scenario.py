"""What the simulated vehicle is asked to fly: it says itself what a scenario is."""

import json
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

from dob_companion.errors import FlightFailedError, InputError


@dataclass(frozen=True, slots=True)
class Scenario:
    """A scenario as `python -m sitl NAME --about` tells it. `asked` is the name or the path by which it is flown."""

    asked: str
    title: str
    seconds: float
    checks: int


def told_by_vehicle(arguments: list[str]) -> dict[str, Any]:
    """What `python -m sitl … --about` prints. Raises InputError or FlightFailedError with the vehicle's own words."""
    told = subprocess.run(
        [sys.executable, "-m", "sitl", "--about", *arguments], capture_output=True, text=True, check=False
    )
    if told.returncode:
        words = told.stderr.strip().splitlines()
        said = words[-1].removeprefix("sitl: ") if words else f"{' '.join(arguments)}: the vehicle says nothing"
        raise FlightFailedError(said) if told.returncode == 1 else InputError(said)
    about: dict[str, Any] = json.loads(told.stdout)
    return about


def scenario_of(asked: str) -> Scenario:
    """Ask the vehicle. Raises InputError for one that it does not know, or that has no off and on to compare."""
    about = told_by_vehicle(["--", asked])
    if about["seconds"] is None:
        raise InputError(
            f"scenario {asked} has no windows, so there is no off and on to compare; it is flown by hand: "
            f"python -m sitl {asked}"
        )
    return Scenario(asked, about["title"], about["seconds"], about["checks"])

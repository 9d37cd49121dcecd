"""Aircraft files: a design.json, or what of it describes the aircraft, to a frozen `OwnAircraft`.

Only `dt`, `delay_samples` and of each block `axes`, `problem.plant`, `problem.controller` are read, and what an
aircraft file may have besides: `attitude_gain` and `clock`. Everything else in a design is somebody else's.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from sitl.airframe.state_space import StateSpace
from sitl.attitude import Vector
from sitl.autopilot.own import Group, OwnAircraft
from sitl.constants import AXES, DT
from sitl.errors import ScenarioError
from sitl.scenario.spec import Clock, read_clock
from sitl.scenario.tables import Table

SCHEMAS = ("dob-companion/design/1", "dob-companion/aircraft/1")

MOST_DELAY = 20


def load_aircraft(path: Path) -> tuple[OwnAircraft, Clock | None]:
    """An aircraft and how its clock stamps. Raises ScenarioError, one line that names file and key."""
    file = Table(str(path), "", _read(path))
    file.choice("schema", SCHEMAS)
    dt = file.number("dt", 1e-9, 1e6)
    if abs(dt / DT - 1.0) > 1e-9:
        raise ScenarioError(
            f"{file.where('dt')}: {dt:g} s is {1.0 / dt:g} Hz; the simulated vehicle flies {1.0 / DT:g} Hz"
        )
    own = OwnAircraft(
        source=str(path),
        groups=tuple(_groups(file)),
        delay_samples=file.whole("delay_samples", 0, MOST_DELAY),
        attitude_gain=_attitude_gain(file),
    )
    clock = file.optional_table("clock")
    return own, read_clock(clock) if clock else None


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError) as trouble:
        raise ScenarioError(f"{path}: cannot be read as UTF-8 text: {trouble}") from None
    except (ValueError, RecursionError) as trouble:
        raise ScenarioError(f"{path}: not JSON: {trouble}") from None
    if not isinstance(content, dict):
        raise ScenarioError(f"{path}: expected a JSON object, as in design.json")
    return content


def _groups(file: Table) -> list[Group]:
    groups: list[Group] = []
    for block in file.items("blocks"):
        names = block.texts("axes")
        taken = [i for group in groups for i in group.axes]
        if (
            not names
            or any(name not in AXES or AXES.index(name) in taken for name in names)
            or len(set(names)) < len(names)
        ):
            raise ScenarioError(f"{block.where('axes')}: expected different ones of {', '.join(AXES)}, no axis twice")
        problem = block.table("problem")
        plant = _system(problem.table("plant"), len(names))
        if np.any(plant.D):
            raise ScenarioError(
                f"{problem.where('plant.D')}: expected zeros: a gyro cannot show the moment of its own sample"
            )
        axes = tuple(AXES.index(name) for name in names)
        groups.append(Group(axes, plant, _system(problem.table("controller"), len(names))))
    return groups


def _system(table: Table, size: int) -> StateSpace:
    """A square discrete system of `size` inputs and outputs."""
    D = table.matrix("D", size, size)
    n = table.length("A")
    return StateSpace(table.matrix("A", n, n), table.matrix("B", n, size), table.matrix("C", size, n), D)


def _attitude_gain(file: Table) -> Vector | None:
    gain = file.optional_table("attitude_gain")
    return gain.axes(0.0, 100.0) if gain else None

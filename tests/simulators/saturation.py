"""A disturbance beyond what PX4's motors can hold, in its simulator: what the daemon makes of a saturated allocator.

    DOB_PX4=… python -m tests.simulators.saturation design.json -o DIR

Calm and moderate wind about yaw, then one that the allocator cannot place, then moderate again; off, then on.
Linux only, in a network of its own.
"""

import argparse
import json
import re
import time
from pathlib import Path

import numpy as np

from tests.ardupilot.namespace import go_inside
from tests.ardupilot.programs import UPDATE_S
from tests.simulators.aircraft import AIRCRAFT, COMPANION, Flight, Wire, hover

STAGES = {"moderate, 1 rad/s²": 1.0, "beyond the motors, 16 rad/s²": 16.0, "moderate again": 1.0}
STAGE_S, YAW = 15.0, 2


def stage(flight: Flight, name: str, amplitude: float) -> dict:
    """One strength of wind: the yaw, what the allocator could not place, and what the daemon said."""
    times = np.arange(0.0, 4.0, UPDATE_S)
    flight.disturb({YAW: amplitude * np.sin(2 * np.pi * times / 4.0)})
    time.sleep(4.0)
    begun, said = len(flight.ground.attitudes), len(flight.texts)
    flight.mark(name)
    unplaced = []
    while time.monotonic() < flight.marks[name] + STAGE_S:
        text = flight.simulator.shell("listener", "control_allocator_status", "-n", 1).stdout
        found = re.search(r"unallocated_torque: \[([^\]]*)\]", text)
        if found:
            unplaced.append(float(found.group(1).split(",")[YAW]))
        time.sleep(0.2)
    flight.mark(f"{name}, end")
    yaw = np.unwrap(np.array(flight.ground.attitudes[begun:])[:, 3])
    told = np.array(flight.ground.telemetry)
    return {
        "what": name,
        "rms": float(np.degrees(yaw.std())),
        "unplaced": float(np.mean(np.abs(unplaced) > np.float64(0.01))) if unplaced else None,
        "largest unplaced": float(np.max(np.abs(unplaced), initial=0.0)),
        "altitude": flight.ground.altitude,
        "largest d_hat": float(np.abs(told[-round(50 * STAGE_S) :, 3]).max()) if len(told) else None,
        "said": [text for _, _, text in flight.texts[said:] if "DOB" in text],
    }


def fly(flight: Flight) -> list[dict]:
    """All stages without and with the observer."""
    rows = []
    with flight.companion():
        flight.take_off()
        for on in (False, True):
            flight.disturb({YAW: 0.0 * np.arange(4)})
            time.sleep(3.0)
            if on:
                flight.enable()
            for name, amplitude in STAGES.items():
                rows.append({"on": on} | stage(flight, f"{name}{', on' if on else ''}", amplitude))
        flight.ground.set("DOB_ENABLE", 0.0, component=COMPANION)
    return rows


def main() -> None:
    """Enter the namespace, then fly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", type=Path)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    arguments = parser.parse_args()
    go_inside("tests.simulators.saturation")
    directory = arguments.o.resolve()
    with hover(AIRCRAFT["px4"], arguments.design.resolve(), directory) as flight:
        rows = fly(flight)
    wire = Wire.of(AIRCRAFT["px4"], directory / "wire.log")
    for row in rows:
        acts = wire.acting(flight.marks[row["what"]], flight.marks[f"{row['what']}, end"])
        row["largest correction"] = float(np.abs(acts[:, 7]).max(initial=0.0))
        row["largest moment"] = float(np.abs(acts[:, 4]).max(initial=0.0))
        print({key: round(value, 4) if isinstance(value, float) else value for key, value in row.items()}, flush=True)
    (directory / "result.json").write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()

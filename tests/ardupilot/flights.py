"""Fly a design in ArduPilot's simulator, without and with it in one flight, and say what it was worth:

    DOB_ARDUCOPTER=/path/to/arducopter python -m tests.ardupilot.flights design.json -o DIR [PROGRAM…]
    DOB_ARDUPLANE=/path/to/arduplane python -m tests.ardupilot.flights design.json --tailsitter -o DIR [PROGRAM…]

Linux only, and root or user namespaces: simulator, companion and ground station run in a network of their own.
Prints a table; DIR gets result.json and the telemetry log of the ground station's link.
"""

import argparse
import json
import math
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pymavlink import DFReader

from dob_companion.artifact import loads
from tests.ardupilot.asked import logged, not_done
from tests.ardupilot.namespace import go_inside
from tests.ardupilot.programs import AXES, PROGRAMS, UPDATE_S, Program, signal
from tests.ardupilot.promised import promises
from tests.ardupilot.simulator import Ground, companion, copter
from tests.ardupilot.tailsitter import OPTIONS, PlaneGround, tailsitter

COPTER = ("DOB_ARDUCOPTER", copter, Ground, ())
TAILSITTER = ("DOB_ARDUPLANE", tailsitter, PlaneGround, OPTIONS)
ACTIVE = 4
SKIPPED_S = 2.0


def window(ground: Ground, program: Program) -> dict[str, dict[str, float]]:
    """Disturb for the length of a window; RMS and peak of the attitude, deg, and the mean estimate."""
    values = signal(program, SKIPPED_S + program.window_s)
    begin, counted = time.monotonic(), len(ground.attitudes)
    told = len(ground.telemetry)
    for i, value in enumerate(values):
        ground.disturb({AXES.index(axis): float(value) for axis in program.axes})
        if i * UPDATE_S < SKIPPED_S:
            counted, told = len(ground.attitudes), len(ground.telemetry)
        time.sleep(max(0.0, begin + (i + 1) * UPDATE_S - time.monotonic()))
    attitudes = np.unwrap(np.array(ground.attitudes[counted:])[:, 1:], axis=0)
    telemetry = np.array(ground.telemetry[told:] or [[math.nan] * 10])
    ground.disturb({AXES.index(axis): 0.0 for axis in program.axes})
    found = {}
    for i, axis in enumerate(AXES):
        angle = np.degrees(attitudes[:, i] - attitudes[:, i].mean())
        found[axis] = {
            "rms": float(np.sqrt(np.mean(angle**2))),
            "peak": float(np.max(np.abs(angle))),
            "estimate": float(telemetry[:, 1 + i].mean()),
            "from_s": ground.attitudes[counted][0],
            "to_s": ground.attitudes[-1][0],
        }
    return found


def fly(ground: Ground, names: list[str], design: Path) -> list[dict]:
    """Each program without and with the observer, in the air; before it what the design promises."""
    rows = []
    promise = promises(loads(design.read_text()))
    for (name, axis), ratio in promise.items():
        print(f"promised: {name:12} {axis:6} {ratio:5.1f}x", flush=True)
    for name in names:
        program = PROGRAMS[name]
        off = window(ground, program)
        ground.set("DOB_ENABLE", 1.0, component=191)
        ground.wait("ACTIVE", lambda: bool(ground.telemetry) and ground.telemetry[-1][7] == ACTIVE, 20.0)
        texts = len(ground.texts)
        on = window(ground, program)
        said = [text for _, _, text in ground.texts[texts:] if "DOB" in text]
        ground.set("DOB_ENABLE", 0.0, component=191)
        time.sleep(1.0)
        rows += [
            {
                "program": name,
                "axis": axis,
                "rms_off": off[axis]["rms"],
                "rms_on": on[axis]["rms"],
                "peak_off": off[axis]["peak"],
                "peak_on": on[axis]["peak"],
                "estimate_off": off[axis]["estimate"],
                "estimate_on": on[axis]["estimate"],
                "off_s": [off[axis]["from_s"], off[axis]["to_s"]],
                "on_s": [on[axis]["from_s"], on[axis]["to_s"]],
                "promised": promise.get((name, axis)),
                "said": said,
            }
            for axis in program.axes
        ]
        print(line(rows[-len(program.axes)]), flush=True)
    return rows


def add_truth(rows: list[dict], log: Path) -> None:
    """The moment that the rate controller has held against the disturbance while off, from ArduPilot's own log."""
    reader = DFReader.DFReader_binary(str(log))
    held = []
    while (message := reader.recv_match(type="RATE")) is not None:
        held.append((message.TimeUS * 1e-6, message.ROut, message.POut, message.YOut))
    table = np.array(held)
    for row in rows:
        begin, end = row["off_s"]
        inside = (table[:, 0] >= begin) & (table[:, 0] <= end)
        row["true"] = float(-table[inside, 1 + AXES.index(row["axis"])].mean())


def compared(rows: list[dict], not_done: Callable[[float, float], np.ndarray]) -> list[dict]:
    """The rows of a flight with what was not done of what was asked for, RMS in deg, off and on; prints it beside the
    promise. `not_done` has it of a window, each axis."""
    found = []
    for row in rows:
        axis = AXES.index(row["axis"])
        off, on = (float(not_done(*row[f"{name}_s"])[axis]) for name in ("off", "on"))
        found.append(row | {"not_done_off": off, "not_done_on": on})
        promise = f"{row['promised']:.1f}" if row["promised"] else ""
        print(
            f"{row['program']:12} {row['axis']:6} estimate less setpoint {off:6.3f}° -> {on:7.4f}° ({off / on:5.1f}x)  "
            f"promised {promise}",
            flush=True,
        )
    return found


def keep(directory: Path, ground: Ground, rows: list[dict]) -> None:
    """result.json, and the attitudes of the flight for `tests.ardupilot.picture`: time s, roll, pitch, yaw rad."""
    np.save(directory / "attitudes.npy", np.array(ground.attitudes))
    (directory / "result.json").write_text(json.dumps(rows, indent=1) + "\n")


def line(row: dict) -> str:
    """One row of the table."""
    return (
        f"{row['program']:12} {row['axis']:6} RMS {row['rms_off']:6.3f}° -> {row['rms_on']:7.4f}° "
        f"({row['rms_off'] / row['rms_on']:5.1f}x)  peak {row['peak_off']:5.2f}° -> {row['peak_on']:5.2f}°  "
        f"d_hat {row['estimate_off']:.5f} {row['estimate_on']:.5f}  {'; '.join(row['said'])}"
    )


def main() -> None:
    """Enter the namespace, then fly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", type=Path)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    parser.add_argument(
        "--tailsitter", action="store_true", help="ArduPlane's tail-sitter in hover, not ArduCopter's quad"
    )
    parser.add_argument("program", nargs="*", metavar="PROGRAM", help=", ".join(PROGRAMS))
    arguments = parser.parse_intermixed_args()
    if unknown := set(arguments.program) - set(PROGRAMS):
        parser.error(f"no such program: {', '.join(sorted(unknown))}")
    go_inside("tests.ardupilot.flights")
    directory = arguments.o.resolve()
    directory.mkdir(parents=True, exist_ok=True)
    variable, aircraft, station, options = TAILSITTER if arguments.tailsitter else COPTER
    with aircraft(Path(os.environ[variable]), directory):
        ground = station(directory / "ground.tlog")
        try:
            with companion(arguments.design.resolve(), directory, *options, "--record", directory / "record"):
                ground.fly()
                time.sleep(5.0)
                rows = fly(ground, arguments.program or list(PROGRAMS), arguments.design)
        finally:
            (directory / "texts.json").write_text(json.dumps(ground.texts, indent=1))
            ground.close()
    log = directory / "logs" / "00000001.BIN"
    add_truth(rows, log)
    keep(directory, ground, compared(rows, not_done(logged(log))))


if __name__ == "__main__":
    main()

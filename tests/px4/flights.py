"""Flies the daemon with PX4 in its own simulator and measures attitudes with the observer off and on, in one flight.

    DOB_PX4=/path/to/bin/px4 python -m tests.px4.flights DESIGN.json -o DIR [PROGRAM…]

Everything goes through MAVLink, as a user's ground station would do it: disturbances as torque of the motors (see
sih_disturbance), DOB_ENABLE through the autopilot to component 191, attitudes from the ground station's link. Windows
as in tests.ardupilot.flights. What an observer can change is the attitude less what is asked for, both as PX4 knows
them: that comes from its own log (see `attitude`). DIR holds the logs, the daemon's record and result.json.
"""

import argparse
import json
import os
import shutil
import time
from pathlib import Path

import numpy as np

from tests.ardupilot.flights import compared, fly, keep
from tests.ardupilot.namespace import go_inside
from tests.ardupilot.programs import AXES, PROGRAMS
from tests.ardupilot.recorded import messages
from tests.ardupilot.simulator import companion
from tests.px4.attitude import not_done
from tests.px4.simulator import COMPANION_LINK, Px4Ground, sih

AUTOPILOT = 1


def add_truth(rows: list[dict], folder: Path) -> None:
    """The moment that the rate controller has held against the disturbance while off, from the module's own reports."""
    held = [
        (message.time_usec * 1e-6, *message.data[:3])
        for piece in sorted(folder.glob("*.tlog"))
        for message in messages(piece.stem, AUTOPILOT, folder)
        if message.get_type() == "DEBUG_FLOAT_ARRAY" and message.name == "DOB_ACT"
    ]
    table = np.array(held)
    for row in rows:
        begin, end = row["off_s"]
        inside = (table[:, 0] >= begin) & (table[:, 0] <= end)
        row["true"] = float(-table[inside, 1 + AXES.index(row["axis"])].mean())


def main() -> None:
    """Enter the namespace, then fly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", type=Path)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    parser.add_argument("program", nargs="*", metavar="PROGRAM", help=", ".join(PROGRAMS))
    arguments = parser.parse_intermixed_args()
    if unknown := set(arguments.program) - set(PROGRAMS):
        parser.error(f"no such program: {', '.join(sorted(unknown))}")
    go_inside("tests.px4.flights")
    directory = arguments.o.resolve()
    directory.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(directory / "record", ignore_errors=True)
    with sih(Path(os.environ["DOB_PX4"]), directory):
        ground = Px4Ground(directory / "ground.tlog")
        try:
            record = ("--record", directory / "record")
            with companion(arguments.design.resolve(), directory, *record, link=COMPANION_LINK):
                ground.fly()
                time.sleep(5.0)
                rows = fly(ground, arguments.program or list(PROGRAMS), arguments.design)
        finally:
            (directory / "texts.json").write_text(json.dumps(ground.texts, indent=1))
            ground.close()
    add_truth(rows, directory / "record")
    keep(directory, ground, compared(rows, not_done(directory)))


if __name__ == "__main__":
    main()

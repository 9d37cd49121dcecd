"""Flies the daemon with PX4 in its own simulator and measures attitudes with the observer off and on, in one flight.

    DOB_PX4=/path/to/bin/px4 python -m tests.px4.flights DESIGN.json -o DIR [PROGRAM…]

Everything goes through MAVLink, as a user's ground station would do it: disturbances as torque of the motors (see
sih_disturbance), DOB_ENABLE through the autopilot to component 191, attitudes from the ground station's link. Windows
as in tests.ardupilot.flights. DIR holds the logs, the daemon's record and result.json.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

from tests.ardupilot.flights import PROGRAMS, fly
from tests.ardupilot.simulator import companion, in_namespace
from tests.px4.simulator import COMPANION_LINK, Px4Ground, sih


def main() -> None:
    """Enter the namespace, then fly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", type=Path)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    parser.add_argument("program", nargs="*", metavar="PROGRAM", help=", ".join(PROGRAMS))
    arguments = parser.parse_intermixed_args()
    if unknown := set(arguments.program) - set(PROGRAMS):
        parser.error(f"no such program: {', '.join(sorted(unknown))}")
    if "DOB_FLIGHT_INSIDE" not in os.environ:
        command = in_namespace("-m", "tests.px4.flights", *sys.argv[1:])
        sys.exit(subprocess.run(command, env=os.environ | {"DOB_FLIGHT_INSIDE": "1"}, check=False).returncode)
    directory = arguments.o.resolve()
    directory.mkdir(parents=True, exist_ok=True)
    with sih(Path(os.environ["DOB_PX4"]), directory):
        ground = Px4Ground(directory / "ground.tlog")
        try:
            record = ("--record", directory / "record")
            with companion(arguments.design.resolve(), directory, *record, link=COMPANION_LINK):
                ground.fly()
                time.sleep(5.0)
                rows = fly(ground, arguments.program or list(PROGRAMS))
        finally:
            (directory / "texts.json").write_text(json.dumps(ground.texts, indent=1))
            ground.close()
    (directory / "result.json").write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()

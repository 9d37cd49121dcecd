"""From no model to a flown design, beside a real autopilot in its simulator: `tune --link` in hover, then off and on:

    DOB_ARDUCOPTER=… python -m tests.simulators.tuned ardupilot -o DIR [PROGRAM…]
    DOB_ARDUPLANE=…  python -m tests.simulators.tuned arduplane -o DIR [PROGRAM…]
    DOB_PX4=…        python -m tests.simulators.tuned px4 -o DIR [PROGRAM…]

Programs as in tests.ardupilot.flights. DIR/tuned is what `tune` has made. Linux only, in a network of its own.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

from tests.ardupilot import asked
from tests.ardupilot import simulator as ardupilot
from tests.ardupilot.flights import COPTER, TAILSITTER, compared, fly, keep
from tests.ardupilot.namespace import go_inside
from tests.ardupilot.programs import PROGRAMS
from tests.px4 import simulator as px4
from tests.px4.attitude import not_done
from tests.simulators.aircraft import COMPANION

WANTED = ("sine-roll", "sine-pitch", "noise-roll", "noise-pitch", "noise-yaw")
LIMIT = 0.3
"""DOB_LIMIT in the flight, normalized torque: noise in yaw comes to 0.27, and a design from calm air allows 0.15."""
AIRCRAFT = {
    "ardupilot": (*COPTER, ardupilot.COMPANION_LINK),
    "arduplane": (*TAILSITTER, ardupilot.COMPANION_LINK),
    "px4": ("DOB_PX4", px4.sih, px4.Px4Ground, (), px4.COMPANION_LINK),
}


def as_others() -> None:
    """Without the real-time priority that these flights may have: a design is computed for minutes."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def main() -> None:
    """Enter the namespace, take off, tune, fly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("autopilot", choices=AIRCRAFT)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    parser.add_argument("program", nargs="*", metavar="PROGRAM", help=", ".join(PROGRAMS))
    arguments = parser.parse_intermixed_args()
    go_inside("tests.simulators.tuned")
    variable, aircraft, station, options, link = AIRCRAFT[arguments.autopilot]
    directory = arguments.o.resolve()
    directory.mkdir(parents=True, exist_ok=True)
    with aircraft(Path(os.environ[variable]), directory):
        ground = station(directory / "ground.tlog")
        try:
            ground.fly()
            tune = [sys.executable, "-m", "dob_companion", "tune", "--link", link, "-o", str(directory / "tuned")]
            subprocess.run([*tune, *options], check=True, preexec_fn=as_others)
            design = directory / "tuned" / "design.json"
            with ardupilot.companion(design, directory, *options, link=link):
                ground.set("DOB_LIMIT", LIMIT, component=COMPANION)
                time.sleep(5.0)
                rows = fly(ground, arguments.program or list(WANTED), design)
        finally:
            ground.close()
    if arguments.autopilot == "px4":
        rows = compared(rows, not_done(directory))
    elif arguments.autopilot == "arduplane":
        rows = compared(rows, asked.not_done(asked.logged(directory / "logs" / "00000001.BIN")))
    keep(directory, ground, rows)


if __name__ == "__main__":
    main()

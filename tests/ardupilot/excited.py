"""Excite ArduCopter in its simulator over the link: what `identify` needs, no model given.

    DOB_ARDUCOPTER=/path/to/arducopter python -m tests.ardupilot.excited -o DIR [OPTIONS OF excite…]

Then `dob-companion tune --log DIR/excited/excite.tlog -o DIR`. Linux only, as `tests.ardupilot.flights`.
"""

import argparse
import contextlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from tests.ardupilot.namespace import go_inside
from tests.ardupilot.simulator import COMPANION_LINK, Ground, copter

Aircraft = Callable[[Path], contextlib.AbstractContextManager]


def main(module: str, text: str, aircraft: Aircraft, ground: type[Ground], link: str) -> None:
    """Enter the namespace, take off, excite."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    arguments, more = parser.parse_known_args()
    go_inside(module)
    out = arguments.o.resolve()
    out.mkdir(parents=True, exist_ok=True)
    with aircraft(out):
        station = ground(out / "ground.tlog")
        try:
            station.fly()
            command = [sys.executable, "-m", "dob_companion", "excite", "--link", link, "-o", str(out / "excited")]
            code = subprocess.run([*command, *more], check=False).returncode
        finally:
            station.close()
    sys.exit(code)


if __name__ == "__main__":
    program = Path(os.environ.get("DOB_ARDUCOPTER", "arducopter"))
    main("tests.ardupilot.excited", __doc__, lambda out: copter(program, out), Ground, COMPANION_LINK)

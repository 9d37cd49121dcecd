"""Excite ArduCopter in its simulator over the link, and identify it: no model given.

    DOB_ARDUCOPTER=/path/to/arducopter python -m tests.ardupilot.excited -o DIR [OPTIONS OF excite…]

Then `dob-companion identify --log DIR/excited/excite.tlog -o DIR`. Linux only, as `tests.ardupilot.flights`.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

from tests.ardupilot.simulator import COMPANION_LINK, Ground, copter, in_namespace


def main() -> None:
    """Enter the namespace, take off, excite."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, required=True)
    arguments, more = parser.parse_known_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    if "DOB_FLIGHT_INSIDE" not in os.environ:
        command = in_namespace("-m", "tests.ardupilot.excited", *sys.argv[1:])
        sys.exit(subprocess.run(command, env=os.environ | {"DOB_FLIGHT_INSIDE": "1"}, check=False).returncode)
    with copter(Path(os.environ["DOB_ARDUCOPTER"]), out):
        ground = Ground(out / "ground.tlog")
        try:
            ground.fly()
            command = [sys.executable, "-m", "dob_companion", "excite", "--link", COMPANION_LINK]
            code = subprocess.run([*command, "-o", str(out / "excited"), *more], check=False).returncode
        finally:
            ground.close()
    sys.exit(code)


if __name__ == "__main__":
    main()

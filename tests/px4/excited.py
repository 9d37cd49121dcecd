"""Excite PX4's simulated quadrotor (SIH) over the link: what `identify` needs, no model given.

    DOB_PX4=/path/to/bin/px4 python -m tests.px4.excited -o DIR [OPTIONS OF excite…]

Then `dob-companion tune --log DIR/excited/excite.tlog -o DIR`. Linux only, as `tests.px4.flights`.
"""

import os
from pathlib import Path

from tests.ardupilot.excited import main
from tests.px4.simulator import COMPANION_LINK, Px4Ground, sih

if __name__ == "__main__":
    program = Path(os.environ.get("DOB_PX4", "px4"))
    main("tests.px4.excited", __doc__, lambda out: sih(program, out), Px4Ground, COMPANION_LINK)

"""The daemon killed and started again in mid-disturbance, then MINUTES of it, in PX4's simulator. Prints JSON.

    DOB_PX4=/path/to/bin/px4 python -m tests.px4.hardship DESIGN.json DIR [MINUTES]

What acts is read where the ground station is, from the module's own reports.
"""

import json
import math
import os
import subprocess
import sys
import threading
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

from tests.ardupilot.flights import ACTIVE
from tests.ardupilot.simulator import companion, in_namespace
from tests.px4.simulator import COMPANION_LINK, Px4Ground, sih

AMPLITUDE, UPDATE_S = 6.0, 0.04


class Watching(Px4Ground):
    """Keeps the module's reports, stamp in s and the correction in roll, and disturbs in roll."""

    def __init__(self, log: Path) -> None:
        self.acting: list[tuple[float, float]] = []
        self.disturbing = False
        super().__init__(log)
        threading.Thread(target=self._disturb, daemon=True).start()

    def _take(self, message) -> None:
        if message.get_type() == "DEBUG_FLOAT_ARRAY" and message.name == "DOB_ACT":
            self.acting.append((message.time_usec * 1e-6, message.data[4]))
        super()._take(message)

    def _disturb(self) -> None:
        while self._open:
            value = AMPLITUDE * math.sin(math.pi * time.monotonic()) if self.disturbing else 0.0
            self.disturb({0: value})
            time.sleep(UPDATE_S)

    def active(self) -> None:
        """Switch on and wait until it injects in full."""
        self.set("DOB_ENABLE", 1.0, component=191)
        self.wait("ACTIVE", lambda: bool(self.telemetry) and self.telemetry[-1][7] == ACTIVE, 60.0)


def fly(design: Path, directory: Path, ground: Watching, minutes: float) -> dict:
    """One hover: ACTIVE, killed, started again, ACTIVE again and for so long."""
    found: dict = {}
    with companion(design, directory, link=COMPANION_LINK) as daemon:
        ground.fly()
        ground.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY, 10_000)
        ground.disturbing = True
        ground.active()
        time.sleep(3.0)
        before = len(ground.acting)
        daemon.kill()
        daemon.wait(10)
        killed_at = ground.acting[-1][0]
        time.sleep(2.0)
        found["largest before"] = max(abs(c) for _, c in ground.acting[before - 200 : before])
        found["acting after the kill"] = [(t - killed_at, c) for t, c in ground.acting[before:]]
    before = len(ground.acting)
    ground.telemetry.clear()
    with companion(design, directory, link=COMPANION_LINK):
        time.sleep(6.0)
        found["largest after the return"] = max(abs(c) for _, c in ground.acting[before:])
        before = len(ground.acting)
        ground.active()
        ramp = [c for _, c in ground.acting[before:]]
        found["largest step of the ramp"] = max(abs(b - a) for a, b in pairwise(ramp))
        said, flown = len(ground.texts), len(ground.attitudes)
        time.sleep(60.0 * minutes)
        found["said in the end"] = [text for _, _, text in ground.texts[said:] if "DOB" in text]
        roll = np.degrees([row[1] for row in ground.attitudes[flown:]])
        found["rms"] = float(roll.std()) if len(roll) else None
    found["texts"] = [text for _, _, text in ground.texts if "DOB" in text]
    return found


def main() -> None:
    """Enter the namespace, then fly."""
    if "DOB_FLIGHT_INSIDE" not in os.environ:
        command = in_namespace("-m", "tests.px4.hardship", *sys.argv[1:])
        sys.exit(subprocess.run(command, env=os.environ | {"DOB_FLIGHT_INSIDE": "1"}, check=False).returncode)
    design, directory = (Path(argument).resolve() for argument in sys.argv[1:3])
    minutes = float(sys.argv[3]) if len(sys.argv) > 3 else 0.0
    directory.mkdir(parents=True, exist_ok=True)
    with sih(Path(os.environ["DOB_PX4"]), directory):
        ground = Watching(directory / "ground.tlog")
        try:
            print(json.dumps(fly(design, directory, ground, minutes)))
        finally:
            ground.close()


if __name__ == "__main__":
    main()

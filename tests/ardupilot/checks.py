"""The script in ArduCopter's simulator, in hover, with a companion that sends what a check wants. Prints JSON.

DOB_ARDUCOPTER=/path/to/arducopter python -m tests.ardupilot.checks DIR
"""

import json
import os
import sys
import threading
import time
from pathlib import Path

import numpy as np
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mav

from tests.ardupilot.namespace import go_inside
from tests.ardupilot.simulator import COMPANION_LINK, Ground, copter

SAMPLE_S = 0.004
SWITCH, LOW, HIGH = 300, 0, 2
DO_AUX_FUNCTION, SCRIPTING, STOP = 218, 42701, 2


class Sender:
    """A companion that sends the same correction for every gyro sample and keeps the answers."""

    def __init__(self) -> None:
        self.correction: tuple[float, float, float] | None = (0.0, 0.0, 0.0)
        self.answers: list[tuple[float, ...]] = []
        self._link = mavutil.mavlink_connection(COMPANION_LINK, source_system=1, source_component=191)
        self._open = True
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop sending."""
        self._open = False
        self._thread.join(5)
        self._link.close()

    def _listen(self) -> None:
        beat = 0.0
        while self._open:
            if time.monotonic() >= beat:
                beat = time.monotonic() + 1.0
                self._link.mav.heartbeat_send(mav.MAV_TYPE_ONBOARD_CONTROLLER, mav.MAV_AUTOPILOT_INVALID, 0, 0, 0)
                self._link.mav.command_long_send(
                    1, 1, mav.MAV_CMD_SET_MESSAGE_INTERVAL, 0, mav.MAVLINK_MSG_ID_HIGHRES_IMU, 4000, 0, 0, 0, 0, 0
                )
            message = self._link.recv_match(blocking=True, timeout=0.2)
            kind = message.get_type() if message else ""
            if kind == "HIGHRES_IMU" and self.correction is not None:
                self._link.mav.debug_vect_send(b"DOB_CORR", message.time_usec, *self.correction)
            elif kind == "ACTUATOR_CONTROL_TARGET":
                self.answers.append((message.time_usec * 1e-6, *message.controls))

    def since(self, count: int) -> np.ndarray:
        """Answers after the first `count`: stamp s, moment, thrust, correction, age."""
        return np.array(self.answers[count:])


def settle(ground: Ground, sender: Sender, seconds: float) -> dict[str, float]:
    """Let some time pass; then the mean of what the rate controller asks for in roll, and of what is added."""
    count = len(sender.answers)
    time.sleep(seconds)
    rows = sender.since(count)
    late = rows[len(rows) // 2 :]
    return {
        "controller": float((late[:, 1] - late[:, 5]).mean()),
        "added": float(late[:, 5].mean()),
        "rate_hz": float((len(rows) - 1) / (rows[-1, 0] - rows[0, 0])),
        "age": float(np.median(late[:, 8])),
        "roll": ground.attitudes[-1][1],
    }


def integrator(ground: Ground, seconds: float) -> float:
    """Mean integral term of the roll rate controller over the last second of some."""
    time.sleep(seconds - 1.0)
    terms = []
    for _ in range(20):
        time.sleep(0.05)
        terms.append(ground.newest["PID_TUNING"].I)
    return float(np.mean(terms))


def fly(ground: Ground, sender: Sender) -> dict:
    """One hover, all checks."""
    found: dict = {}
    ground.wait("answers", lambda: len(sender.answers) > 500)
    found["neutral"] = settle(ground, sender, 4.0)
    sender.correction = (0.05, 0.0, 0.0)
    found["added"] = settle(ground, sender, 6.0)
    found["integrator while added"] = integrator(ground, 2.0)
    ground.command(DO_AUX_FUNCTION, SWITCH, LOW)
    found["switched off"] = settle(ground, sender, 4.0)
    ground.command(DO_AUX_FUNCTION, SWITCH, HIGH)
    found["switched on"] = settle(ground, sender, 6.0)
    count = len(sender.answers)
    sender.correction = None
    time.sleep(1.0)
    found["silence"] = sender.since(count)[:, [0, 5]].tolist()
    sender.correction = (0.05, 0.0, 0.0)
    found["back"] = settle(ground, sender, 6.0)
    ground.command(SCRIPTING, STOP)
    ground.wait("scripting stopped", lambda: any("Scripting: stopped" in text for _, _, text in ground.texts))
    found["integrator after the end of the script"] = integrator(ground, 8.0)
    found["roll after the end of the script"] = ground.attitudes[-1][1]
    found["altitude"] = ground.altitude
    found["texts"] = [text for _, _, text in ground.texts if "DOBC" in text]
    return found


def main() -> None:
    """Enter the namespace, then fly."""
    go_inside("tests.ardupilot.checks")
    directory = Path(sys.argv[1]).resolve()
    directory.mkdir(parents=True, exist_ok=True)
    with copter(Path(os.environ["DOB_ARDUCOPTER"]), directory, GCS_PID_MASK=1):
        ground, sender = Ground(directory / "ground.tlog"), Sender()
        try:
            ground.fly()
            ground.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 194, 50_000)  # PID_TUNING
            print(json.dumps(fly(ground, sender)))
        finally:
            (directory / "texts.json").write_text(json.dumps(ground.texts, indent=1))
            sender.close()
            ground.close()


if __name__ == "__main__":
    main()

"""The module in PX4's simulator, in hover, with a companion that sends what a check wants. Prints JSON.

DOB_PX4=/path/to/bin/px4 python -m tests.px4.checks DIR
"""

import json
import os
import struct
import sys
import threading
import time
from pathlib import Path

import numpy as np
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mav

from tests.ardupilot.namespace import go_inside
from tests.px4.simulator import COMPANION_LINK, Px4Ground, Sih, sih

STREAMS_US = {mav.MAVLINK_MSG_ID_HIGHRES_IMU: 4000, mav.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY: 4000}


class Sender:
    """A companion that sends the same correction for every gyro sample and keeps the answers."""

    def __init__(self) -> None:
        self.correction: tuple[float, float, float] | None = (0.0, 0.0, 0.0)
        self.answers: list[tuple[float, ...]] = []
        self.stamps: list[int] = []
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
            if time.monotonic() >= beat and self._link.clients_last_alive:
                beat = time.monotonic() + 1.0
                self._hail()
            message = self._link.recv_match(blocking=True, timeout=0.2)
            kind = message.get_type() if message else ""
            if kind == "HIGHRES_IMU":
                self.stamps.append(message.time_usec)
                if self.correction is not None:
                    payload = struct.pack("<Q3f", message.time_usec, *self.correction).ljust(128, b"\0")
                    self._link.mav.tunnel_send(1, 1, 53425, 20, payload)
            elif kind == "DEBUG_FLOAT_ARRAY" and message.name == "DOB_ACT":
                self.answers.append((message.time_usec * 1e-6, *message.data[:8]))

    def _hail(self) -> None:
        self._link.mav.heartbeat_send(mav.MAV_TYPE_ONBOARD_CONTROLLER, mav.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        for message, interval in STREAMS_US.items():
            self._link.mav.command_long_send(
                1, 1, mav.MAV_CMD_SET_MESSAGE_INTERVAL, 0, message, interval, 0, 0, 0, 0, 0
            )

    def since(self, count: int) -> np.ndarray:
        """Answers after the first `count`: stamp s, moment, thrust, correction, age µs."""
        return np.array(self.answers[count:])


def settle(ground: Px4Ground, sender: Sender, seconds: float) -> dict[str, float]:
    """Let some time pass; then the mean of what the rate controller asks for in roll, and of what is added."""
    count, heard = len(sender.answers), len(sender.stamps)
    time.sleep(seconds)
    rows, stamps = sender.since(count), np.array(sender.stamps[heard:])
    late = rows[len(rows) // 2 :]
    return {
        "controller": float((late[:, 1] - late[:, 5]).mean()),
        "added": float(late[:, 5].mean()),
        "rate_hz": float((len(rows) - 1) / (rows[-1, 0] - rows[0, 0])),
        "gyro_hz": float(1e6 * (len(stamps) - 1) / (stamps[-1] - stamps[0])),
        "repeats": int(np.sum(np.diff(rows[:, 0]) <= 0.0)),
        "age_us": float(np.median(late[:, 8])),
        "age_95_us": float(np.quantile(late[:, 8], 0.95)),
        "thrust": float(late[:, 4].mean()),
        "roll": ground.attitudes[-1][1],
    }


def fly(vehicle: Sih, ground: Px4Ground, sender: Sender) -> dict:
    """One hover, all checks."""
    found: dict = {}
    ground.wait("answers", lambda: len(sender.answers) > 500)
    found["neutral"] = settle(ground, sender, 4.0)
    sender.correction = (0.05, 0.0, 0.0)
    found["added"] = settle(ground, sender, 8.0)
    vehicle.shell("param", "set", "DOBC_AUX", 1)
    ground.stick = -1000
    found["switched off"] = settle(ground, sender, 6.0)
    ground.stick = 1000
    found["switched on"] = settle(ground, sender, 8.0)
    vehicle.shell("param", "set", "DOBC_AUX", 0)
    count = len(sender.answers)
    sender.correction = None
    time.sleep(1.0)
    found["silence"] = sender.since(count)[:, [0, 5]].tolist()
    sender.correction = (0.05, 0.0, 0.0)
    found["back"] = settle(ground, sender, 8.0)
    found["stopped in flight"] = vehicle.shell("dob_correction", "stop").returncode
    vehicle.shell("param", "set", "DOBC_EN", 0)
    found["disabled"] = settle(ground, sender, 6.0)
    found["status"] = vehicle.shell("dob_correction", "status").stdout
    found["altitude"] = ground.altitude
    found["texts"] = [text for _, _, text in ground.texts if "DOBC" in text]
    return found


def refusals(directory: Path) -> dict[str, str]:
    """What the module says to parameters that it does not start with."""
    program, said = Path(os.environ["DOB_PX4"]), {}
    for name, value in {"DOBC_EN": 0, "CA_AIRFRAME": 2}.items():
        with sih(program, directory / name, **{name: value}) as vehicle:
            tried = vehicle.shell("dob_correction", "start")
            said[name] = f"{tried.returncode} {tried.stdout}"
    return said


def main() -> None:
    """Enter the namespace, then fly."""
    go_inside("tests.px4.checks")
    directory = Path(sys.argv[1]).resolve()
    directory.mkdir(parents=True, exist_ok=True)
    with sih(Path(os.environ["DOB_PX4"]), directory, COM_RC_IN_MODE=1) as vehicle:
        ground, sender = Px4Ground(directory / "ground.tlog"), Sender()
        try:
            ground.fly()
            found = fly(vehicle, ground, sender)
        finally:
            (directory / "texts.json").write_text(json.dumps(ground.texts, indent=1))
            sender.close()
            ground.close()
    print(json.dumps(found | {"refusals": refusals(directory)}))


if __name__ == "__main__":
    main()

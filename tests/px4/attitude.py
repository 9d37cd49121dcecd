"""What a flight's attitudes are made of, from PX4's own log of it:

    python -m tests.px4.attitude DIR

DIR is that of a flight of tests.simulators.endurance or tests.px4.flights. The simulator's truth is what the
controllers are asked for, plus what they fail to do, plus what PX4's estimator does not know: an observer of
disturbances can change the second alone. RMS in deg, observer off and on, and how often a motor was at its stop.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pyulog import ULog

AXES = ("roll", "pitch", "yaw")
TRUTH, ESTIMATE, ASKED = "vehicle_attitude_groundtruth", "vehicle_attitude", "vehicle_attitude_setpoint"
MOTORS, MOTOR_COUNT = "actuator_motors", 4
EVERY_S, AT_STOP = 0.02, 1e-3


def angles(quaternions: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw in deg, without jumps of a turn, of rows w, x, y, z."""
    w, x, y, z = quaternions.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.degrees(np.unwrap(np.column_stack([roll, pitch, yaw]), axis=0))


def parts(truth: np.ndarray, estimate: np.ndarray, asked: np.ndarray) -> dict[str, np.ndarray]:
    """RMS of each about its mean, by axis; rows of angles at the same times."""
    return {
        "truth": truth.std(axis=0),
        "not done": (estimate - asked).std(axis=0),
        "asked for": asked.std(axis=0),
        "not known": (estimate - truth).std(axis=0),
    }


def windows(directory: Path) -> dict[str, list[tuple[float, float]]]:
    """When the observer was off and on, s of the autopilot's clock, in all pieces of a flight."""
    if (directory / "attitudes.npz").exists():
        with np.load(directory / "attitudes.npz") as kept:
            return {name: [(float(kept[name][0, 0]), float(kept[name][-1, 0]))] for name in ("off", "on")}
    rows = json.loads((directory / "result.json").read_text())
    return {name: [tuple(row[f"{name}_s"]) for row in rows] for name in ("off", "on")}


class Log:
    """What is needed of a .ulg."""

    def __init__(self, path: Path) -> None:
        found = ULog(str(path), [TRUTH, ESTIMATE, ASKED, MOTORS]).data_list
        self.data = {each.name: each.data for each in found if each.multi_id == 0}

    def at(self, topic: str, field: str, times: np.ndarray) -> np.ndarray:
        """Angles of a topic at these times."""
        data = self.data[topic]
        whole = angles(np.column_stack([data[f"{field}[{i}]"] for i in range(4)]))
        return np.column_stack([np.interp(times, data["timestamp"] * 1e-6, column) for column in whole.T])

    def parts(self, begin: float, end: float) -> dict[str, np.ndarray]:
        """Of a window, what `parts` says."""
        times = np.arange(begin, end, EVERY_S)
        return parts(self.at(TRUTH, "q", times), self.at(ESTIMATE, "q", times), self.at(ASKED, "q_d", times))

    def at_stop(self, begin: float, end: float) -> float:
        """Share of the looks at which the allocator had a motor at one of its stops."""
        data = self.data[MOTORS]
        times = data["timestamp"] * 1e-6
        motors = np.column_stack([data[f"control[{i}]"] for i in range(MOTOR_COUNT)])[(times >= begin) & (times < end)]
        return float(((motors < AT_STOP) | (motors > 1.0 - AT_STOP)).any(axis=1).mean())


def not_done(directory: Path) -> Callable[[float, float], np.ndarray]:
    """By window (begin, end) of a flight in `directory`, in s: RMS of estimate less setpoint, deg, of each axis."""
    log = log_of(directory)
    return lambda begin, end: log.parts(begin, end)["not done"]


def log_of(directory: Path) -> Log:
    """Of a flight in `directory`."""
    return Log(next((directory / "vehicle" / "log").rglob("*.ulg")))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path, metavar="DIR")
    directory = parser.parse_args().directory
    log = log_of(directory)
    spans = windows(directory)
    for off, on in zip(spans["off"], spans["on"], strict=True):
        print(f"motor at a stop: off {log.at_stop(*off):.2%}, on {log.at_stop(*on):.2%} of looks")
        without, with_ = log.parts(*off), log.parts(*on)
        print("| axis | truth off | on | not done off | on | off/on | asked for off | on | not known off | on |")
        print("| --- |" + " --: |" * 9)
        for i, axis in enumerate(AXES):
            pairs = {name: f"{without[name][i]:.3f}° | {with_[name][i]:.3f}°" for name in without}
            ratio = without["not done"][i] / with_["not done"][i]
            print(
                f"| {axis} | {pairs['truth']} | {pairs['not done']} | {ratio:.1f} | {pairs['asked for']} "
                f"| {pairs['not known']} |"
            )


if __name__ == "__main__":
    main()

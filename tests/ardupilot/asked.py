"""What ArduPilot's attitude controller did not do of what it was asked for, from its own log (.BIN) of a flight.

A position hold asks for other attitudes all the time; no observer of disturbances can change those.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pymavlink import DFReader

FIELDS = ("DesRoll", "DesPitch", "DesYaw", "Roll", "Pitch", "Yaw")


def logged(log: Path) -> np.ndarray:
    """Rows of time in s; roll, pitch, yaw asked for and there, deg: of hover's axes, also of a tail-sitter."""
    reader = DFReader.DFReader_binary(str(log))
    rows = []
    while (message := reader.recv_match(type="ANG")) is not None:
        rows.append((message.TimeUS * 1e-6, *(getattr(message, name) for name in FIELDS)))
    return np.array(rows)


def not_done(rows: np.ndarray) -> Callable[[float, float], np.ndarray]:
    """By window (begin, end) in s: RMS about its mean of attitude less setpoint, deg, of each axis."""

    def of(begin: float, end: float) -> np.ndarray:
        window = rows[(rows[:, 0] >= begin) & (rows[:, 0] <= end), 1:]
        return np.unwrap(window[:, 3:] - window[:, :3], period=360.0, axis=0).std(axis=0)

    return of

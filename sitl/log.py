"""The flight recorder: one row per sample, compact while flying, named arrays afterwards."""

from array import array

import numpy as np
from numpy.typing import NDArray

from sitl.airframe.surroundings import Surroundings
from sitl.attitude import Vector
from sitl.autopilot.vehicle import START_US, Sample
from sitl.constants import DT_US

NO_WINDOW, OFF_WINDOW, ON_WINDOW = 0, 1, 2
"""Which window a sample lies in: none, observer off, observer on."""

STATES = ("DISABLED", "WAITING", "TRACKING", "RAMP_IN", "ACTIVE", "RAMP_OUT", "FAULT")
"""What the companion tells of itself, in the order of its numbers."""

UNTOLD = -1

_COLUMNS = (
    ("stamp_us", 1, np.int64),
    ("window", 1, np.int8),
    ("rate", 3, np.float64),
    ("gyro", 3, np.float64),
    ("u_e", 3, np.float64),
    ("correction", 3, np.float64),
    ("age", 1, np.int16),
    ("disturbance", 3, np.float64),
    ("attitude_error", 3, np.float64),
    ("rate_setpoint", 3, np.float64),
    ("quaternion", 4, np.float64),
    ("position", 3, np.float64),
    ("wind", 3, np.float64),
    ("moment", 3, np.float64),
)
_WIDTH = sum(width for _, width, _ in _COLUMNS)

Arrays = dict[str, NDArray[np.generic]]


class FlightLog:
    """Rows of doubles (stamps stay exact up to 2^53 µs), which samples were answered, and the companion's states."""

    def __init__(self) -> None:
        self._rows = array("d")
        self._answered = bytearray()
        self._states = array("b")

    def add(self, sample: Sample, window: int, around: Surroundings, position: Vector) -> None:
        """Record one sample."""
        s = sample
        age = min(s.age, 32767)
        self._rows.extend((s.stamp_us, window, *s.rate, *s.gyro, *s.u_e, *s.correction, age))
        self._rows.extend((*s.disturbance, *s.attitude_error, *s.rate_setpoint, *s.quaternion))
        self._rows.extend((*position, *around.wind, *around.moment))
        self._answered.append(0)
        self._states.append(UNTOLD)

    def answer(self, stamp_us: int) -> None:
        """Note that an answer to the sample with this stamp came; other stamps are nobody's answer."""
        index = self._index(stamp_us)
        if index is not None:
            self._answered[index] = 1

    def state(self, stamp_us: int, state: int) -> None:
        """Note the state that the companion told with the stamp of a sample."""
        index = self._index(stamp_us)
        if index is not None and 0 <= state < len(STATES):
            self._states[index] = state

    def _index(self, stamp_us: int) -> int | None:
        index, rest = divmod(stamp_us - START_US, DT_US)
        return index if rest == 0 and 0 <= index < len(self._answered) else None

    def arrays(self) -> Arrays:
        """Arrays over the whole flight at 250 Hz, N samples: see `flight.npz` in docs/scenarios.md."""
        table = np.array(self._rows).reshape(-1, _WIDTH)
        result: Arrays = {}
        start = 0
        for name, width, kind in _COLUMNS:
            block = table[:, start : start + width]
            result[name] = (block[:, 0] if width == 1 else block).astype(kind)
            start += width
        result["answered"] = np.frombuffer(bytes(self._answered), np.uint8).astype(bool)
        result["state"] = np.array(self._states, np.int8)
        return result

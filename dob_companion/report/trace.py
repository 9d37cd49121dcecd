"""A recorded flight of the simulated vehicle, read from the bytes of its flight.npz."""

import io
import zipfile
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import InputError

WINDOWS = {"none": 0, "off": 1, "on": 2}

# name -> (dtype, columns; 0 for a plain vector)
_FIELDS: dict[str, tuple[Any, int]] = {
    "stamp_us": (np.int64, 0),
    "window": (np.int8, 0),
    "rate": (np.float64, 3),
    "gyro": (np.float64, 3),
    "u_e": (np.float64, 3),
    "correction": (np.float64, 3),
    "disturbance": (np.float64, 3),
    "attitude_error": (np.float64, 3),
    "age": (np.int16, 0),
    "quaternion": (np.float64, 4),
    "answered": (np.bool_, 0),
}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FlightTrace:
    """One row per sample (250 Hz), hover axes in the order roll, pitch, yaw.

    stamp_us        (N,)   vehicle clock, µs, strictly increasing
    window          (N,)   0 neither, 1 observer off, 2 observer on
    rate            (N, 3) true body rate y, rad/s
    gyro            (N, 3) measured body rate y_n, rad/s
    u_e             (N, 3) moment applied, correction included, normalized torque
    correction      (N, 3) the correction contained in u_e, normalized torque
    disturbance     (N, 3) d, normalized torque
    attitude_error  (N, 3) e = 2 sign(q0) vec(q_cmd^-1 q), rad
    age             (N,)   samples between the correction and the gyro sample it answers, -1 without one
    quaternion      (N, 4) attitude, scalar first
    answered        (N,)   the companion answered this sample
    """

    stamp_us: NDArray[np.int64]
    window: NDArray[np.int8]
    rate: NDArray[np.float64]
    gyro: NDArray[np.float64]
    u_e: NDArray[np.float64]
    correction: NDArray[np.float64]
    disturbance: NDArray[np.float64]
    attitude_error: NDArray[np.float64]
    age: NDArray[np.int16]
    quaternion: NDArray[np.float64]
    answered: NDArray[np.bool_]

    @classmethod
    def from_bytes(cls, raw: bytes, source: str = "flight.npz") -> "FlightTrace":
        """Parse an .npz. Raises InputError, one line that begins with `source` and names the array."""
        try:
            archive = np.load(io.BytesIO(raw), allow_pickle=False)
            found = {name: archive[name] for name in archive.files}  # a lone array has no files
        except (ValueError, OSError, EOFError, KeyError, AttributeError, zipfile.BadZipFile):
            raise InputError(f"{source}: not a flight trace: expected an .npz of plain arrays") from None
        arrays = {name: _checked(found, name, source) for name in _FIELDS}
        rows = len(arrays["stamp_us"])
        for name, array in arrays.items():
            if len(array) != rows:
                raise InputError(f"{source}: {name} has {len(array)} rows, expected {rows} as in stamp_us")
        if rows < 2 or np.any(np.diff(arrays["stamp_us"]) <= 0):
            raise InputError(f"{source}: stamp_us: expected at least two stamps, each later than the one before")
        for name in ("off", "on"):
            if not np.any(arrays["window"] == WINDOWS[name]):
                raise InputError(f"{source}: window: expected samples of the {name} window ({WINDOWS[name]})")
        return cls(**arrays)

    def rows(self, window: str) -> slice:
        """From the first to the last sample of the window "off" or "on"."""
        index = np.flatnonzero(self.window == WINDOWS[window])
        return slice(int(index[0]), int(index[-1]) + 1)

    def seconds(self, rows: slice | None = None) -> NDArray[np.float64]:
        """Time in s since the first of `rows`, by default since the first sample of the off window."""
        chosen = self.stamp_us if rows is None else self.stamp_us[rows]
        origin = self.stamp_us[self.rows("off").start] if rows is None else chosen[0]
        return np.asarray((chosen - origin) * 1e-6, dtype=np.float64)


def _checked(found: dict[str, Any], name: str, source: str) -> Any:
    if name not in found:
        raise InputError(f"{source}: array {name!r} is missing")
    dtype, columns = _FIELDS[name]
    array = found[name]
    shape = f"(N, {columns})" if columns else "(N,)"
    if array.ndim != (2 if columns else 1) or (columns and array.shape[1] != columns):
        raise InputError(f"{source}: {name} has shape {array.shape}, expected {shape}")
    if array.dtype.kind not in "iufb" or (np.dtype(dtype).kind in "iu" and array.dtype.kind not in "iu"):
        raise InputError(f"{source}: {name} holds {array.dtype}, expected {np.dtype(dtype)}")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{source}: {name} holds a number that is not finite")
    frozen = np.array(array, dtype=dtype)
    frozen.setflags(write=False)
    return frozen

"""Units of ArduPilot's RATE: they have changed, and the log's own table of units does not say so.

Up to Copter 3.3 rates are in centidegrees/s and outputs in counts to 5000, then in degrees/s and -1…1; some write
rad/s and declare deg/s all the same. IMU has always been in rad/s, so where it is logged it decides.
"""

import math

import numpy as np

from dob_companion.identification.record import Floats
from dob_companion.logs.series import Series

COUNTS = 5000.0
_SCALES = {"rad/s": 1.0, "deg/s": math.pi / 180.0, "centidegrees/s": math.pi / 18000.0}
_LEAST = 1e-3
"""rad/s: below this an aircraft stands still, and nothing can be told from its rates."""


def torque_scale(out: Floats) -> tuple[float, list[str]]:
    """Factor that makes -1…1 of what is logged, and what to say of it."""
    sizes = np.abs(out[np.isfinite(out)])
    largest = float(np.percentile(sizes, 99)) if sizes.size else 0.0  # one that is damaged tells nothing
    if largest <= 2.0:
        return 1.0, []
    return 1.0 / COUNTS, [f"moments of {largest:.4g} and more: taken as counts, {COUNTS:g} of them full"]


def rate_scale(rates: Series, declared: str, imu: Series | None, *, counts: bool) -> tuple[float, list[str]]:
    """Factor that makes rad/s of what is logged, and what to say of it; `counts`: moments are in counts."""
    unit = _by_imu(rates, imu)
    if unit:
        said = [f"RATE is in {unit}, as IMU shows"]
        if declared in _SCALES and declared != unit:
            said = [f"RATE is in {unit}, as IMU shows, and not in {declared} as the log's table of units has it"]
        return _SCALES[unit], said
    unit = "centidegrees/s" if counts else declared if declared in _SCALES else "deg/s"
    why = "moments are in counts" if counts else "the log says so" if unit == declared else "nothing says otherwise"
    return _SCALES[unit], [f"RATE is taken as in {unit}: {why}"]


def _by_imu(rates: Series, imu: Series | None) -> str:
    """The unit that makes the rates those of the IMU over the same time; "" where that shows nothing."""
    if imu is None or len(imu.time) < 2 or len(rates.time) < 2:
        return ""
    begin = max(np.nanmin(imu.time), np.nanmin(rates.time))
    end = min(np.nanmax(imu.time), np.nanmax(rates.time))
    size = []
    for series in (rates, imu):
        within = (series.time >= begin) & (series.time <= end) & np.isfinite(series.values).all(axis=1)
        turning = np.linalg.norm(series.values[within], axis=1)
        size.append(float(np.median(turning)) if turning.size else math.nan)
    logged, true = size
    if not (math.isfinite(logged) and math.isfinite(true)) or true < _LEAST or logged <= 0.0:
        return ""
    off = {unit: abs(math.log(scale * logged / true)) for unit, scale in _SCALES.items()}
    unit = min(off, key=off.__getitem__)
    return unit if off[unit] < math.log(5.0) else ""

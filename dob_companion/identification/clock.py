"""Whether a record's clock and its gyro agree with the attitude in it: rates, added up, are the change of the angles.

A clock that runs fast makes of the same turn a longer one. So does a gyro of another scale; of the record alone the two
are not told apart, nor need they be. The autopilot's estimator adds up the same gyro by its own clock, so that over a
fraction of a second the two agree within a percent in any flight in which the aircraft turns at all.
"""

import numpy as np

from dob_companion.identification.record import Floats, Record

BLOCK_S = 0.2
"""Angles are compared over so long: accelerometers and compass move the estimate more slowly."""
LEAST_RAD, FEWEST = 3e-3, 200
"""RMS of the turns, and how many of them, below which nothing is told."""
STEEP_RAD = 1.0
"""Pitch beyond which Euler's angles are no measure."""
OFF = 0.05


def doubt(record: Record) -> str:
    """Why the stamps or the gyro's scale cannot be right; "" where they can, or where nothing tells."""
    low, high = turned(record)
    if low > 1.0 + OFF or high < 1.0 - OFF:
        ratio = np.sqrt(low * high)
        return (
            f"by the gyro the aircraft turned {1.0 / ratio:.3g} times as far as by its attitude: the record's clock is "
            "wrong by as much, or the gyro's scale"
        )
    return ""


def turned(record: Record) -> tuple[float, float]:
    """What the attitude turned, over what the gyro did: by least squares of the one and of the other, between which the
    truth is, for noise in one draws the first down, and in the other the second up. 0 and infinity where nothing
    tells."""
    unknown = 0.0, float("inf")
    attitude, rates = record.attitude, record.rates
    if attitude is None or len(attitude.time) < FEWEST or len(rates.time) < FEWEST:
        return unknown
    angles = np.unwrap(attitude.values, axis=0)
    inside = (attitude.time >= rates.time[0]) & (attitude.time <= rates.time[-1])
    time, angles = attitude.time[inside], angles[inside]
    if len(time) < FEWEST:
        return unknown
    turns = _at(time, rates.time, _added_up(rates.time, _euler_rates(_at(rates.time, time, angles), rates.values)))
    later = np.searchsorted(time, time + BLOCK_S)
    first = np.flatnonzero((later < len(time)) & (np.abs(angles[:, 1]) < STEEP_RAD))
    first = first[time[later[first]] - time[first] < 2.0 * BLOCK_S]
    if len(first) < FEWEST:
        return unknown
    one, other = (each[later[first]] - each[first] for each in (angles, turns))
    one, other = one - one.mean(axis=0), other - other.mean(axis=0)
    shared, own = float(np.sum(one * other)), float(np.sum(other**2))
    if shared <= 0.0 or own < len(first) * LEAST_RAD**2:
        return unknown
    return shared / own, float(np.sum(one**2)) / shared


def _euler_rates(angles: Floats, rates: Floats) -> Floats:
    """How fast roll, pitch and yaw change, of body rates."""
    roll, pitch = angles[:, 0], np.clip(angles[:, 1], -STEEP_RAD, STEEP_RAD)
    p, q, r = rates.T
    about = q * np.sin(roll) + r * np.cos(roll)
    return np.column_stack([p + about * np.tan(pitch), q * np.cos(roll) - r * np.sin(roll), about / np.cos(pitch)])


def _added_up(time: Floats, rates: Floats) -> Floats:
    steps = np.diff(time)[:, None] * (rates[1:] + rates[:-1]) / 2.0
    return np.vstack([np.zeros(rates.shape[1]), np.cumsum(steps, axis=0)])


def _at(when: Floats, time: Floats, values: Floats) -> Floats:
    return np.column_stack([np.interp(when, time, column) for column in values.T])

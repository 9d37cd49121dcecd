"""Was any correction computed from bad data? Judged from the wire, which a relay has kept.

The relay has every message, those included that it lost, spoilt, delayed or exchanged before the companion saw them. A
companion may ask for zero, or for a correction that answers a sample which arrived whole, finite and within the limit;
a sample that comes again is answered with the very same.

How near the corrections are to those of a perfect wire is measured besides: an observer of the design's matrices is
stepped here in plain numbers over the complete data. What is told is the distance from a share 0 <= f <= 1 of its
correction, the same f for all axes, in shares of the limit; while f falls (a fade) the correction is an old one and is
not compared. A wire that loses nothing shows what this reference is worth, which knows neither the companion's grid of
samples nor what it puts in for missing ones. Bad data that are taken for good are far from it: tests/endurance has the
oracle that needs no such measure, for a design that is worked out by hand.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dob_companion.artifact import DobDesign
from tests.simulators.aircraft import AUTOPILOT, HIGHRES_IMU, Aircraft, component, correction, number, payload, whole
from tests.simulators.relay import Way, passed

AXES = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class Verdict:
    """Corrections by kind, and what was wrong with any; distances from complete-data ones in shares of the limit."""

    answered: int
    zero: int
    compared: int
    not_whole: int
    changed: int
    beyond_limit: int
    rms: float
    largest: float

    @property
    def wrong(self) -> int:
        """Corrections that must not have been sent."""
        return self.not_whole + self.changed + self.beyond_limit


def on_grid(gyro: np.ndarray, acts: np.ndarray, dt: float, *, line: bool) -> tuple[np.ndarray, ...]:
    """A grid of dt, the rates there on the line between samples, and the mean moment of each interval of it.

    `gyro`: stamp, rates; `acts`: stamp, moment, correction in it. Corrections are held; so is the controller's part,
    unless a script reads it now and then: then it lies on a `line` between readings.
    """
    grid = np.arange(gyro[0, 0], gyro[-1, 0], dt)
    y = np.column_stack([np.interp(grid, gyro[:, 0], column) for column in gyro[:, 1:].T])
    fine = (grid[:, None] + dt * (np.arange(8) + 0.5) / 8.0).ravel()
    held = acts[np.clip(np.searchsorted(acts[:, 0], fine, side="right") - 1, 0, None)]
    controller = held[:, 1:4] - held[:, 4:7]
    if line:
        controller = np.column_stack(
            [np.interp(fine, acts[:, 0], column) for column in (acts[:, 1:4] - acts[:, 4:7]).T]
        )
    return grid, y, (controller + held[:, 4:7]).reshape(len(grid), 8, 3).mean(axis=1)


def observed(design: DobDesign, y: np.ndarray, u: np.ndarray) -> np.ndarray:
    """d_hat at each sample, by axis."""
    found = np.zeros_like(y)
    for block in design.blocks:
        at = [AXES.index(axis) for axis in block.axes]
        A, B, C, D = (np.asarray(m) for m in (block.observer.A, block.observer.B, block.observer.C, block.observer.D))
        x, both = np.zeros(len(A)), np.hstack([y[:, at], u[:, at]])
        for k, value in enumerate(both):
            found[k, at] = C @ x + D @ value
            x = A @ x + B @ value
    return found


def judge(aircraft: Aircraft, design: DobDesign, limit: float, log: Path, begin: float, end: float) -> Verdict:
    """All corrections of a span of monotonic time."""
    gyro, acts, asked, arrived = [], [], [], set()
    for p in passed(log):
        if p.way is Way.UP and begin <= p.came < end and (found := correction(p.frame)):
            asked.append((found[0] * 1e-6, *found[1]))
        elif p.way is Way.DOWN and component(p.frame) == AUTOPILOT and number(p.frame) == HIGHRES_IMU:
            fields = np.frombuffer(payload(p.frame, 62)[:32], dtype=np.dtype("<u8,<6f4"))[0]
            gyro.append((fields[0] * 1e-6, *fields[1][3:6]))
            if whole(p):
                arrived.add(int(fields[0]))
        elif p.way is Way.DOWN and (row := aircraft.applied(p.frame)):
            acts.append(row)
    grid, y, u = on_grid(np.array(sorted(set(gyro))), np.array(acts), design.dt, line=aircraft.script)
    complete = -observed(design, y, u)
    asked_rows = np.array(asked)
    stamps, c = asked_rows[:, 0], asked_rows[:, 1:]
    r = np.clip(np.column_stack([np.interp(stamps, grid, column) for column in complete.T]), -limit, limit)
    return compared(stamps, c, r, arrived, limit)


def compared(stamps: np.ndarray, c: np.ndarray, r: np.ndarray, arrived: set[int], limit: float) -> Verdict:
    """Corrections `c` under these stamps against those of complete data `r`."""
    acting = np.any(c != 0.0, axis=1)
    f = share(c, r)
    falling = np.zeros(len(c), dtype=bool)
    falling[1:] = np.linalg.norm(c[1:], axis=1) < np.linalg.norm(c[:-1], axis=1)
    full = acting & (f > 0.98)
    left = np.abs(c - f[:, None] * r) / limit
    fades = acting & ~full & falling
    residual = left[acting & ~fades]
    micros = np.round(stamps * 1e6).astype(np.int64)
    return Verdict(
        answered=len(c),
        zero=int((~acting).sum()),
        compared=len(residual),
        not_whole=sum(int(stamp) not in arrived for stamp in micros[acting]),
        changed=int(((np.diff(micros) <= 0) & np.any(np.diff(c, axis=0) != 0.0, axis=1) & acting[1:]).sum()),
        beyond_limit=int((np.abs(c) > limit + 1e-6).any(axis=1).sum() + (~np.isfinite(c)).any(axis=1).sum()),
        rms=float(np.sqrt(np.mean(residual**2))) if len(residual) else 0.0,
        largest=float(residual.max(initial=0.0)),
    )


def share(c: np.ndarray, r: np.ndarray) -> np.ndarray:
    """The share f of `r` that is nearest to `c`."""
    return np.clip(np.sum(c * r, axis=1) / np.maximum(np.sum(r * r, axis=1), 1e-12), 0.0, 1.0)

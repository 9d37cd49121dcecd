"""Was any correction computed from bad data? Judged from the wire, with an observer that has the complete data.

The relay has every message, those included that it lost, spoilt, delayed or exchanged before the companion saw them. An
observer of the design's matrices, stepped here in plain numbers over all of them, says what the companion would ask for
on a perfect wire. On a bad one it may ask for

* zero, or
* a correction that answers a sample which arrived whole, each sample at most once, in order, within the limit, and of
  the same kind as the one of complete data: a share 0 <= f <= 1 of it, the same for all axes, and of what is left the
  mean of squares is within the bound by which the design bears missing samples (the error at most doubles, so they add
  sqrt(3) times the error that the design foresees), and no single one exceeds SIGMAS times that bound.

While f falls (a fade) the correction is an old one that may only shrink; f is judged by how it moves there.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dob_companion.artifact import DobDesign
from dob_companion.lti.gramian import gramian
from dob_companion.lti.loop import weighted_loop
from dob_companion.lti.statespace import StateSpaceData
from dob_companion.observer.missing import stated_weather
from tests.simulators.aircraft import AUTOPILOT, HIGHRES_IMU, Aircraft, component, correction, number, payload, whole
from tests.simulators.relay import Way, passed

SIGMAS = 6.0
AXES = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class Verdict:
    """Corrections by kind, and what was wrong with any; residuals in shares of the bound."""

    answered: int
    zero: int
    compared: int
    not_whole: int
    repeated: int
    beyond_limit: int
    rms: float
    largest: float
    apart: int

    @property
    def wrong(self) -> int:
        """Corrections that no good data explain."""
        return self.not_whole + self.repeated + self.beyond_limit + self.apart


def foreseen(design: DobDesign) -> np.ndarray:
    """RMS of the estimation error that the design foresees in its weather, by axis; normalized torque."""
    found = []
    for block in design.blocks:
        weather, size = stated_weather(block.certificate), len(block.observer.C)
        assert weather is not None, "a design without stated weather cannot be judged"
        pole = float(np.exp(-2.0 * np.pi * weather.corner_hz * design.dt))
        one = np.eye(size)
        disturbance = StateSpaceData(pole * one, one, weather.disturbance_rms * np.sqrt(1.0 - pole**2) * one, 0.0 * one)
        noise = StateSpaceData([], [], [], weather.noise_rms * one)
        problem = block.problem
        loop = weighted_loop(
            problem.plant, problem.controller, block.observer, disturbance, noise, block.delay_samples
        )  # fmt: skip
        C, D = loop.error
        found += list(np.sqrt(np.diag(C @ gramian(loop.A, loop.B) @ C.T + D @ D.T)))
    return np.array(found)


def on_grid(stamps: np.ndarray, rates: np.ndarray, acts: np.ndarray, dt: float) -> tuple[np.ndarray, ...]:
    """Rates at a grid of dt, on the line between samples; moments as their mean over each interval of the grid."""
    grid = np.arange(stamps[0], stamps[-1], dt)
    y = np.column_stack([np.interp(grid, stamps, column) for column in rates.T])
    edges = np.append(grid, grid[-1] + dt)
    fine = (edges[:-1, None] + dt * (np.arange(8) + 0.5) / 8.0).ravel()
    held = np.clip(np.searchsorted(acts[:, 0], fine, side="right") - 1, 0, None)
    u = acts[held, 1:4].reshape(len(grid), 8, 3).mean(axis=1)
    return grid, y, u


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
    samples = np.array(sorted(set(gyro)))
    grid, y, u = on_grid(samples[:, 0], samples[:, 1:], np.array(acts), design.dt)
    complete = -observed(design, y, u)
    asked_rows = np.array(asked)
    stamps, c = asked_rows[:, 0], asked_rows[:, 1:]
    r = np.clip(np.column_stack([np.interp(stamps, grid, column) for column in complete.T]), -limit, limit)
    return compared(stamps, c, r, arrived, limit, np.sqrt(3.0) * foreseen(design))


def compared(
    stamps: np.ndarray, c: np.ndarray, r: np.ndarray, arrived: set[int], limit: float, bound: np.ndarray
) -> Verdict:
    """Corrections `c` under these stamps against those of complete data `r`."""
    acting = np.any(c != 0.0, axis=1)
    f = share(c, r)
    falling = np.zeros(len(c), dtype=bool)
    falling[1:] = np.linalg.norm(c[1:], axis=1) < np.linalg.norm(c[:-1], axis=1)
    full = acting & (f > 0.98)
    left = np.abs(c - f[:, None] * r) / bound
    fades = acting & ~full & falling
    residual = left[acting & ~fades]
    micros = np.round(stamps * 1e6).astype(np.int64)
    return Verdict(
        answered=len(c),
        zero=int((~acting).sum()),
        compared=len(residual),
        not_whole=sum(int(stamp) not in arrived for stamp in micros[acting]),
        repeated=int((np.diff(micros[acting]) <= 0).sum()),
        beyond_limit=int((np.abs(c) > limit + 1e-6).any(axis=1).sum() + (~np.isfinite(c)).any(axis=1).sum()),
        rms=float(np.sqrt(np.mean(residual**2))) if len(residual) else 0.0,
        largest=float(residual.max(initial=0.0)),
        apart=int((residual > SIGMAS).any(axis=1).sum()),
    )


def share(c: np.ndarray, r: np.ndarray) -> np.ndarray:
    """The share f of `r` that is nearest to `c`."""
    return np.clip(np.sum(c * r, axis=1) / np.maximum(np.sum(r * r, axis=1), 1e-12), 0.0, 1.0)

"""Which parts of a record an identification may use: in flight, without holes and saturation, and excited."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dob_companion.identification.grid import Flags, Grid, holding, runs
from dob_companion.identification.record import Floats, Record
from dob_companion.identification.result import Segment

SHORTEST_S = 4.0
"""Of a stretch."""
BLOCK_S = 1.0
SATURATED = 0.1
"""Share of a block in which the mixer may be at its limits."""
FULL = 0.995
"""A normalized torque this large is at its limit."""
QUIET = 0.15
"""Of the strong blocks' rms: a block below it is not excited."""
HOVERING = 0.05
"""Least thrust of what flies, where the source does not say whether it does."""

INJECTED = "injected signal"
USED, HOLE, DISARMED, LANDED, LIMITED = range(5)
WORDS = {
    HOLE: "samples are missing",
    DISARMED: "disarmed",
    LANDED: "on the ground",
    LIMITED: "mixer or motors saturated",
}


@dataclass(frozen=True, slots=True)
class Instrument:
    """What moves the aircraft and is not moved by it: name, values at the grid's points (n, 3), least rms that counts.

    It acts on for `tail` blocks.
    """

    name: str
    values: Floats
    least: float
    tail: int


def instruments(grid: Grid) -> tuple[Instrument, ...]:
    """All that there are, the best first. Of angles their changes: what drifts leaks into all frequencies."""
    found = []
    if grid.injected is not None:
        found.append(Instrument(INJECTED, grid.injected, 5e-4, 1))
    if grid.attitude_setpoint is not None:
        steps = np.diff(grid.attitude_setpoint, axis=0, prepend=grid.attitude_setpoint[:1])
        found.append(Instrument("attitude setpoint", steps / grid.dt, 0.01, 2))
    if grid.rate_setpoint is not None:
        found.append(Instrument("rate setpoint", grid.rate_setpoint, 0.01, 2))
    return tuple(found)


def states(record: Record, grid: Grid) -> np.ndarray:
    """For each point of the grid what speaks against it, or USED."""
    time = grid.time
    state = np.full(len(time), USED)
    limited = holding(record.saturated, time, unknown=False)[:, None] | (np.abs(grid.moment) >= FULL)
    size = max(1, round(BLOCK_S / grid.dt))
    share = np.convolve(limited.any(axis=1), np.ones(size) / size, "same")
    state[share > SATURATED] = LIMITED
    flying = holding(record.flying, time, unknown=True)
    if record.flying is None and record.thrust is not None and len(record.thrust.time):
        flying = np.interp(time, record.thrust.time, record.thrust.values[:, 0]) > HOVERING
    state[~flying] = LANDED
    state[~holding(record.armed, time, unknown=True)] = DISARMED
    state[~grid.known] = HOLE
    return state


def excited(instrument: Instrument, axis: int, usable: Flags, dt: float) -> Flags:
    """Where the instrument moves this axis, each point of the grid."""
    size = max(1, round(BLOCK_S / dt))
    blocks = len(usable) // size
    out = np.zeros(len(usable), bool)
    values = np.where(usable, instrument.values[:, axis], 0.0)[: blocks * size].reshape(blocks, size)
    rms = np.sqrt(np.mean(values**2, axis=1))
    strong = rms[rms > instrument.least]
    if not len(strong):
        return out
    active = rms > max(instrument.least, QUIET * float(np.quantile(strong, 0.9)))
    reach = np.ones(2 * instrument.tail + 1)
    active = np.convolve(active, reach, "same") > 0.5 if blocks > len(reach) else active
    out[: blocks * size] = np.repeat(active, size)
    out[blocks * size :] = blocks > 0 and active[-1]
    return out & usable


def stretches(flags: Flags, dt: float) -> list[tuple[int, int]]:
    """Runs that are long enough."""
    return [(a, b) for a, b in runs(flags) if (b - a) * dt >= SHORTEST_S]


def segments(grid: Grid, state: np.ndarray, used: Mapping[str, Sequence[tuple[int, int]]]) -> tuple[Segment, ...]:
    """All of the record in order of time: what was used and for which axes, and what not and why."""
    time = np.append(grid.time, grid.time[-1] + grid.dt)
    code = np.zeros(len(state), int)
    for bit, spans in enumerate(used.values()):
        for a, b in spans:
            code[a:b] += 1 << bit
    whole = np.where(state != USED, -state, code)
    edges = np.concatenate(([0], np.flatnonzero(np.diff(whole)) + 1, [len(whole)]))
    found = []
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        axes = tuple(axis for bit, axis in enumerate(used) if whole[a] > 0 and whole[a] >> bit & 1)
        why = "" if axes else WORDS.get(int(-whole[a]), f"not excited, or shorter than {SHORTEST_S:g} s")
        found.append(Segment(float(time[a]), float(time[b]), why, axes))
    return tuple(found)

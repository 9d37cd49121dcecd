"""From a certified design to the comparison: the same plant, link and weather for every method."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import DobBlock, DobDesign, StateSpaceData
from dob_companion.comparison.flight import (
    PEAKS_OFF,
    Weather,
    attitude,
    expect,
    make_weather,
    rms,
)
from dob_companion.comparison.measure import delay_margin
from dob_companion.comparison.methods import SOURCES, methods, stated
from dob_companion.comparison.rational import NotApplicableError
from dob_companion.comparison.shortfall import Shortfall, shortfall
from dob_companion.comparison.tuning import Judge, tune
from dob_companion.comparison.vehicle import Vehicle, close, no_observer
from dob_companion.errors import NotCertifiedError, SpecError, UnsolvableError

Array = NDArray[np.float64]

OFF_NOMINAL: tuple[tuple[str, Callable[[Vehicle], Vehicle]], ...] = (
    ("gain −30 %", lambda vehicle: vehicle.with_gain(0.7)),
    ("gain +30 %", lambda vehicle: vehicle.with_gain(1.3)),
    ("delay +1", lambda vehicle: vehicle.with_delay(1)),
    ("delay +2", lambda vehicle: vehicle.with_delay(2)),
)
"""Vehicles that the observers were not designed for. The further delay is one that the vehicle reports in u_e."""


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One observer, measured.

    tuned              held to the common rule (the reference that sets it, and no observer, count as such)
    attenuation        RMS attitude error off / on, one entry per seed, as flown
    peak               mean over the seeds of the peak attitude error with the observer on, rad
    noise_peak_db      largest gain n -> d_hat, dB of normalized torque per rad/s
    noise_rms          RMS of the correction that gyro noise alone causes, normalized torque
    disk_margin        skew 0, loop broken at u_e; delay_margin: further samples, unknown to the observer
    off_nominal        name -> expected attenuation of the vehicle of OFF_NOMINAL, None where unstable
    error              |d -> d - z^-τ d_hat| at the comparison's frequencies
    """

    key: str
    name: str
    source: str
    settings: str
    tuned: bool
    order: int
    attenuation: tuple[float, ...]
    peak: float
    noise_peak_db: float
    noise_rms: float
    disk_margin: float
    delay_margin: int
    off_nominal: dict[str, float | None]
    error: Array

    @property
    def mean(self) -> float:
        """Mean attenuation over the seeds."""
        return float(np.mean(self.attenuation))

    @property
    def spread(self) -> float:
        """Standard deviation of the attenuation over the seeds; 0 for one seed."""
        return float(np.std(self.attenuation, ddof=1)) if len(self.attenuation) > 1 else 0.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AxisComparison:
    """All observers on one axis, and how far the design is from LQG-optimal.

    `absent` holds (name, reason) of methods that have no observer here.
    """

    axis: str
    dt: float
    delay: int
    peak_off: float
    scale: float
    hertz: Array
    rows: tuple[Row, ...]
    absent: tuple[tuple[str, str], ...]
    shortfall: Shortfall

    @property
    def best(self) -> Row:
        """The greatest attenuation among those held to the rule."""
        return max((row for row in self.rows if row.tuned), key=lambda row: row.mean)


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """An observer on its way into the table."""

    key: str
    name: str
    settings: str
    observer: Any
    source: str
    tuned: bool = True


def compare(
    design: DobDesign, seeds: int, source: str, progress: Callable[[str], None] = lambda _: None
) -> tuple[AxisComparison, ...]:
    """Every axis of a design, each against the other methods over `seeds` flights; `progress` hears what is at work.

    Raises SpecError for a block of several axes or a plant with a direct term (the other methods know neither), and
    UnsolvableError when the attitude loop around a block is unstable, with the observer off or with the design's own.
    Messages begin with `source`.
    """
    for block in design.blocks:
        if len(block.axes) > 1:
            raise SpecError(
                f"{source}: block {block.name!r}: axes: the other methods are for one axis, got {block.axes}"
            )
        if np.any(block.problem.plant.D):
            raise SpecError(f"{source}: block {block.name!r}: plant: D: expected 0, the other methods need it")
    return tuple(_compare(block, design.dt, seeds, source, progress) for block in design.blocks)


def _compare(block: DobBlock, dt: float, seeds: int, source: str, progress: Callable[[str], None]) -> AxisComparison:
    vehicle = Vehicle(_system(block.problem.plant, dt), _system(block.problem.controller, dt), block.delay_samples)
    axis = block.axes[0]
    if expect(close(vehicle, no_observer(dt)), 1.0) is None:
        raise UnsolvableError(
            f"{source}: block {block.name!r}: the attitude loop ({vehicle.attitude_gain:g} 1/s) around it is unstable"
        )
    observer, weight = _system(block.observer, dt), _system(block.problem.disturbance_weight, dt)
    progress(f"{axis}: weather of {seeds} seeds")
    weather = make_weather(vehicle, PEAKS_OFF[axis], seeds)
    try:
        judge = Judge.by(vehicle, weather.typical_scale, observer)
    except ValueError as problem:
        raise UnsolvableError(f"{source}: block {block.name!r}: {problem}") from None
    entries = [
        Entry("off", "no observer", "", no_observer(dt), SOURCES["off"]),
        Entry("hinf", "H∞, this design", f"γ {block.certificate.gamma:.4g}", observer, SOURCES["hinf"]),
    ]
    others, absent = _others(judge, weight, lambda name: progress(f"{axis}: tuning {name}"))
    off = rms(_flown(vehicle, no_observer(dt), weather))
    rows = []
    for entry in entries + others:
        progress(f"{axis}: flying {entry.name}")
        rows.append(_measure(entry, judge, weather, off))
    progress(f"{axis}: what is LQG-optimal")
    return AxisComparison(
        axis=axis,
        dt=dt,
        delay=vehicle.delay,
        peak_off=PEAKS_OFF[axis],
        scale=judge.scale,
        hertz=judge.responses.hertz,
        rows=tuple(rows),
        absent=tuple(absent),
        shortfall=shortfall(block, dt, judge.scale),
    )


def _others(judge: Judge, weight: Any, progress: Callable[[str], None]) -> tuple[list[Entry], list[tuple[str, str]]]:
    """The other methods' observers, and (name, reason) of those that have none; all of them stable on the plant."""
    found, absent = [], []
    for method in methods(judge.vehicle, weight, judge.scale):
        progress(method.name)
        try:
            best = tune(method.families, judge)
        except NotApplicableError as reason:
            absent.append((method.name, str(reason)))
            continue
        if best is None:
            absent.append((method.name, "no setting keeps the rule"))
        else:
            found.append(Entry(method.key, method.name, best.settings, best.observer, method.source))
    for plain in stated(judge.vehicle, weight, judge.scale):
        try:
            observer = plain.build()
        except NotApplicableError as reason:
            absent.append((plain.name, str(reason)))
            continue
        if expect(close(judge.vehicle, observer), judge.scale) is None:
            absent.append((plain.name, "unstable on the plant it was designed for"))
        else:
            found.append(Entry(plain.key, plain.name, plain.settings, observer, plain.source, tuned=False))
    return found, absent


def _measure(entry: Entry, judge: Judge, weather: Weather, off: Array) -> Row:
    vehicle, observer = judge.vehicle, entry.observer
    loop = close(vehicle, observer)
    expected, theta = expect(loop, judge.scale), attitude(loop, weather.d, weather.n)
    if expected is None:
        raise NotCertifiedError(f"{entry.name} came into the table although it is not stable on the plant")
    noise_peak = judge.responses.noise_peak(observer)
    return Row(
        key=entry.key,
        name=entry.name,
        source=entry.source,
        settings=entry.settings,
        tuned=entry.tuned,
        order=observer.nstates,
        attenuation=tuple((off / rms(theta)).tolist()),
        peak=float(np.mean(np.max(np.abs(theta), axis=0))),
        noise_peak_db=float(20.0 * np.log10(noise_peak)) if noise_peak > 0.0 else -np.inf,
        noise_rms=expected.noise_in_correction,
        disk_margin=judge.responses.disk_margin(observer),
        delay_margin=delay_margin(vehicle, observer),
        off_nominal={
            name: expected_attenuation(change(vehicle), observer, judge.scale) for name, change in OFF_NOMINAL
        },
        error=np.abs(judge.responses.error(observer)),
    )


def expected_attenuation(vehicle: Vehicle, observer: Any, scale: float) -> float | None:
    """RMS attitude error off / on in expectation, both on this vehicle; None when either loop is unstable."""
    off, on = (expect(close(vehicle, o), scale) for o in (no_observer(vehicle.dt), observer))
    return None if off is None or on is None else off.attitude / on.attitude


def _flown(vehicle: Vehicle, observer: Any, weather: Weather) -> Array:
    return attitude(close(vehicle, observer), weather.d, weather.n)


def _system(data: StateSpaceData, dt: float) -> Any:
    return ct.ss(data.A, data.B, data.C, data.D, dt)

"""From a large log to a finished design: System ID of three axes by ArduPilot, what each step takes.

The log is made here, 13 MB a minute as ArduCopter writes it with fast attitude and IMU: excited in the mixer on one
axis after another, then hover in wind. What is read for nothing are messages of the state estimator. A product of
matrices is timed beside it, in the same run.
"""

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dob_companion.artifact import AXES
from dob_companion.cli.design import design_into
from dob_companion.cli.identification_options import Options
from dob_companion.cli.identifying import SPEC, of_logs
from dob_companion.logs import read_log
from tests.identification.hovering import Axis, fly
from tests.logs import writers

MEGABYTES = float(os.environ.get("BENCH_MEGABYTES", "100"))
MEGABYTES_A_MINUTE = 13.0
LOOP_HZ, EXCITED_S, REST_S = 400.0, 40, 4
PROPORTIONAL, INTEGRAL, ATTITUDE = 0.08, 0.05, 4.0
NAMES = {"roll": b"RLL", "pitch": b"PIT", "yaw": b"YAW"}
FIRST_SID_AXIS = 10


def measure() -> Iterator[str]:
    """Seconds of each step, and of a product of matrices of 2000 beside them."""
    matrix = np.random.default_rng(1).standard_normal((2000, 2000))
    with tempfile.TemporaryDirectory() as name:
        log, out = Path(name) / "flight.bin", Path(name) / "out"
        log.write_bytes(large_log(MEGABYTES))
        yield f"{log.stat().st_size / 1e6:.0f} MB, three axes"
        took, _ = _timed(lambda: read_log(log))
        outcome_s, outcome = _timed(lambda: of_logs([log], Options()))
        if outcome.spec is None:
            raise SystemExit(outcome.why)
        outcome.write(out)
        design_s, _ = _timed(lambda: design_into(out, out / SPEC, auto=True))
        product_s, _ = _timed(lambda: matrix @ matrix)
        yield f"reading           {took:6.1f} s"
        yield f"identifying       {outcome_s - took:6.1f} s"
        yield f"design --auto     {design_s:6.1f} s on {os.cpu_count()} cores"
        yield f"log to design     {outcome_s + design_s:6.1f} s, {(outcome_s + design_s) / product_s:.0f} products"


def large_log(megabytes: float) -> bytes:
    """A .bin of about this size."""
    axis = Axis(p=PROPORTIONAL, i=INTEGRAL, attitude=ATTITUDE, wind=1.0, noise=0.003, injected=0.04)
    period = round((EXCITED_S + REST_S) * LOOP_HZ)
    seconds = max(60.0 * megabytes / MEGABYTES_A_MINUTE, 3.0 * (EXCITED_S + REST_S))
    moved = _one_after_another(period, round(seconds * LOOP_HZ))
    flight = fly([axis] * 3, seconds, 1, rate_hz=LOOP_HZ, moved=moved)
    times = 10.0 + np.arange(len(flight.y)) / LOOP_HZ
    log = writers.copter(times, flight.y, flight.u)
    for name in AXES:
        for key, value in ((b"P", PROPORTIONAL), (b"I", INTEGRAL), (b"D", 0.0), (b"FLTE", 0.0), (b"FLTD", 0.0)):
            log.write("PARM", 1, b"ATC_RAT_" + NAMES[name] + b"_" + key, value)
        log.write("PARM", 1, b"ATC_ANG_" + NAMES[name] + b"_P", ATTITUDE)
    for name, value in ((b"SCHED_LOOP_RATE", LOOP_HZ), (b"INS_GYRO_FILTER", 0.0)):
        log.write("PARM", 1, name, value)
    log.declare("SIDS", "QBf", "TimeUS,Ax,Mag")
    log.declare("SIDD", "Qfffffffff", "TimeUS,Time,Targ,F,Gx,Gy,Gz,Ax,Ay,Az")
    for k in range(3):
        log.write("SIDS", round(1e6 * times[k * period]), FIRST_SID_AXIS + k, 0.06)
        for at in range(k * period, k * period + round(EXCITED_S * LOOP_HZ)):
            rates = np.degrees(flight.y[at]).tolist()
            log.write("SIDD", round(1e6 * times[at]), 0.0, flight.r[at, k], 0.0, *rates, 0.0, 0.0, 0.0)
    log.declare("XKF1", "Qfffffffff", "TimeUS,Roll,Pitch,Yaw,VN,VE,VD,PN,PE,PD")
    others = max(0, int((megabytes * 1e6 - len(log.data)) / 47))
    for stamp in np.linspace(1e6 * times[0], 1e6 * times[-1], others):
        log.write("XKF1", round(stamp), *[0.0] * 9)
    return log.data


def _one_after_another(period: int, whole: int) -> np.ndarray:
    """Noise between 0.3 and 25 Hz on one axis, then the next, then nothing; `period` and `whole` in samples."""
    rng, size = np.random.default_rng(2), round(EXCITED_S * LOOP_HZ)
    hertz = np.fft.rfftfreq(size, 1.0 / LOOP_HZ)
    moved = np.zeros((whole, 3))
    for k in range(3):
        shape = np.where((hertz > 0.3) & (hertz < 25.0), 1.0 / np.sqrt(np.maximum(hertz, 0.3)), 0.0)
        moved[k * period : k * period + size, k] = np.fft.irfft(
            shape * np.exp(2j * np.pi * rng.random(len(hertz))), size
        )
    return moved


def _timed(step: Callable[[], Any]) -> tuple[float, Any]:
    begin = time.perf_counter()
    found = step()
    return time.perf_counter() - begin, found

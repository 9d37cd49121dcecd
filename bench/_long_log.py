"""The log of a copter that flew System ID mode, as large as asked for, with all that a copter logs besides."""

from collections.abc import Iterator

import numpy as np

from dob_companion.artifact import AXES
from tests.identification.hovering import Axis, Flight, fly
from tests.logs import writers

LOOP_HZ, EXCITED_S, REST_S = 400.0, 40, 4
BAND_HZ, FIRST_SID_AXIS, AMPLITUDE = (0.3, 25.0), 10, 0.06
FLOWN = {
    "roll": Axis(gain=250.0, pole=2.0, lag=0.04, delay=0.006, p=0.08, i=0.05, attitude=4.5, wind=1.0, noise=0.003),
    "pitch": Axis(gain=230.0, pole=2.2, lag=0.04, delay=0.006, p=0.085, i=0.05, attitude=4.5, wind=1.0, noise=0.003),
    "yaw": Axis(gain=40.0, pole=1.5, lag=0.04, delay=0.006, p=0.25, i=0.03, attitude=3.0, wind=0.3, noise=0.003),
}
NAMES = {"roll": b"RLL", "pitch": b"PIT", "yaw": b"YAW"}
OTHERS = {
    "XKF1": ("Qfffffffff", "TimeUS,Roll,Pitch,Yaw,VN,VE,VD,PN,PE,PD"),
    "XKF4": ("Qffffffff", "TimeUS,SV,SP,SH,SM,SVT,errRP,OFN,OFE"),
    "RCOU": ("QHHHHHHHH", "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8"),
    "BARO": ("Qffff", "TimeUS,Alt,Press,Temp,CRt"),
    "GPS": ("QBBffffff", "TimeUS,Status,NSats,HDop,Lat,Lng,Alt,Spd,GCrs"),
}
"""What is in the way."""


def long_log(megabytes: float) -> bytes:
    """A .bin of about this size; never shorter than the excitation."""
    period = round((EXCITED_S + REST_S) * LOOP_HZ)
    flight = _flown(3 * period)
    times = 10.0 + np.arange(3 * period) / LOOP_HZ
    log = writers.copter(times, flight.y, flight.u)
    for name, value in _parameters():
        log.write("PARM", 1, name, value)
    log.declare("SIDS", "QBf", "TimeUS,Ax,Mag")
    log.declare("SIDD", "Qfffffffff", "TimeUS,Time,Targ,F,Gx,Gy,Gz,Ax,Ay,Az")
    for k in range(3):
        log.write("SIDS", round(1e6 * times[k * period]), FIRST_SID_AXIS + k, AMPLITUDE)
        for at in range(k * period, k * period + round(EXCITED_S * LOOP_HZ)):
            rates = np.degrees(flight.y[at]).tolist()
            log.write("SIDD", round(1e6 * times[at]), 0.0, flight.r[at, k], 0.0, *rates, 0.0, 0.0, 0.0)
    _fill(log, megabytes, times)
    return log.data


def _flown(count: int) -> Flight:
    """Noise on one axis after another."""
    rng, size = np.random.default_rng(2), round(EXCITED_S * LOOP_HZ)
    hertz = np.fft.rfftfreq(size, 1.0 / LOOP_HZ)
    shape = np.where((hertz > BAND_HZ[0]) & (hertz < BAND_HZ[1]), 1.0 / np.sqrt(np.maximum(hertz, BAND_HZ[0])), 0.0)
    moved = np.zeros((count, 3))
    for k in range(3):
        phases = np.exp(2j * np.pi * rng.random(len(hertz)))
        moved[k * count // 3 :][:size, k] = np.fft.irfft(shape * phases, size)
    return fly(FLOWN.values(), count / LOOP_HZ, 1, rate_hz=LOOP_HZ, moved=moved)


def _parameters() -> Iterator[tuple[bytes, float]]:
    yield b"SCHED_LOOP_RATE", LOOP_HZ
    yield b"INS_GYRO_FILTER", 0.0
    for name in AXES:
        axis = FLOWN[name]
        for key, value in ((b"P", axis.p), (b"I", axis.i), (b"D", 0.0), (b"FLTE", 0.0), (b"FLTD", 0.0)):
            yield b"ATC_RAT_" + NAMES[name] + b"_" + key, value
        yield b"ATC_ANG_" + NAMES[name] + b"_P", axis.attitude


def _fill(log: writers.DataFlash, megabytes: float, times: np.ndarray) -> None:
    """The other messages, in turn, over the whole flight."""
    for name, (layout, columns) in OTHERS.items():
        log.declare(name, layout, columns)
    sizes = [3 + 8 + sum({"f": 4, "H": 2, "B": 1}[kind] for kind in layout[1:]) for layout, _ in OTHERS.values()]
    rounds = max(0, int((1e6 * megabytes - len(log.data)) / sum(sizes)))
    for stamp in np.linspace(1e6 * times[0], 1e6 * times[-1], rounds).astype(int).tolist():
        for name, (layout, _) in OTHERS.items():
            log.write(name, stamp, *[0] * (len(layout) - 1))

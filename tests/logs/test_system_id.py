"""ArduPilot's System ID mode, from its log to the plant: reader, clocks, units and gyro filter together."""

import math

import numpy as np
import pytest

from dob_companion.identification.identify import identify
from dob_companion.logs import read_log
from tests.logs import writers

LOOP_HZ, FINE, SECONDS = 400, 10, 45
GAIN, POLE, DELAY_S, FILTER_HZ = 180.0, 2.4, 0.0023, 20.0
P, ATTITUDE_P = 0.0405, 4.5
FROM_S, TO_S, AMPLITUDE, LOW_HZ, HIGH_HZ = 3.0, 43.0, 0.06, 0.5, 20.0


def chirp(time):
    """The waveform of SIDD.Targ: an exponential chirp."""
    if not FROM_S < time < TO_S:
        return 0.0
    growth = math.log(HIGH_HZ / LOW_HZ) / (TO_S - FROM_S)
    return AMPLITUDE * math.sin(2.0 * math.pi * LOW_HZ * math.expm1(growth * (time - FROM_S)) / growth)


def flown():
    """Times, measured and filtered rate, moment and what of it was injected, of pitch in closed loop with some wind."""
    rng, h = np.random.default_rng(3), 1.0 / (LOOP_HZ * FINE)
    moments = [0.0] * (round(DELAY_S / h) + 1)
    w = math.tan(math.pi * FILTER_HZ / LOOP_HZ)  # second-order Butterworth, as LowPassFilter2p
    c = 1.0 + 2.0 * math.cos(math.pi / 4.0) * w + w * w
    b, a1, a2 = w * w / c, 2.0 * (w * w - 1.0) / c, (1.0 - 2.0 * math.cos(math.pi / 4.0) * w + w * w) / c
    rate = angle = wind = z1 = z2 = 0.0
    rows = []
    for k, (noise, gust) in enumerate(rng.standard_normal((SECONDS * LOOP_HZ, 2)).tolist()):
        measured = rate + 0.002 * noise
        z0 = measured - a1 * z1 - a2 * z2
        filtered, z1, z2 = b * (z0 + 2.0 * z1 + z2), z0, z1
        injected = chirp(k / LOOP_HZ)
        moment = P * (-ATTITUDE_P * angle - filtered) + injected
        rows.append((10.0 + k / LOOP_HZ, measured, filtered, moment, injected))
        wind = math.exp(-0.5 / LOOP_HZ) * wind + 0.5 * gust / math.sqrt(LOOP_HZ)
        for _ in range(FINE):
            moments.append(moment)
            rate += h * (-POLE * rate + GAIN * moments.pop(0) + wind)
            angle += h * rate
    return np.array(rows).T


def test_the_plant_that_flew_is_the_one_that_is_identified(tmp_path):
    times, measured, filtered, moment, injected = flown()
    still = np.zeros_like(times)
    log = writers.copter(times, np.column_stack((still, filtered, still)), np.column_stack((still, moment, still)))
    for name, value in ((b"ATC_RAT_PIT_P", P), (b"ATC_ANG_PIT_P", ATTITUDE_P)):
        log.write("PARM", 1, name, value)
    log.declare("SIDS", "QBf", "TimeUS,Ax,Mag")
    log.declare("SIDD", "Qfffffffff", "TimeUS,Time,Targ,F,Gx,Gy,Gz,Ax,Ay,Az")
    log.write("SIDS", round(1e6 * (times[0] + FROM_S)), 11, AMPLITUDE)
    for time, rate, added in zip(times, measured, injected, strict=True):
        if FROM_S < time - times[0] < TO_S:
            log.write("SIDD", round(1e6 * time), 0.0, added, 0.0, 0.0, math.degrees(rate), 0.0, 0.0, 0.0, 0.0)
    path = tmp_path / "sid.bin"
    path.write_bytes(log.data)
    (record,) = read_log(path)
    pitch = identify(record, axes=("pitch",), rate_hz=250.0).axes["pitch"]
    assert pitch.usable, pitch.why
    assert pitch.model.acceleration_per_unit.value == pytest.approx(GAIN, rel=0.05)
    assert pitch.model.slow_pole_rad_s.value == pytest.approx(POLE, rel=0.25)
    assert pitch.model.delay_s.value == pytest.approx(DELAY_S, abs=0.001)

"""A disturbance and a noise of known spectra in a closed loop of known plant."""

import numpy as np
import pytest
from scipy import signal

from dob_companion.autopilots.transfer import NOTHING, butterworth
from dob_companion.identification.result import AxisModel, Bound, Interval
from dob_companion.identification.surroundings import surroundings

RATE = 250.0
NOISE, DISTURBANCE, CORNER_HZ = 2e-3, 0.02, 0.8


def known(value):
    return Interval(value, value, value)


def model(filters=NOTHING):
    return AxisModel(
        acceleration_per_unit=known(120.0),
        slow_pole_rad_s=known(0.5),
        lag_s=known(0.03),
        delay_s=known(0.0),
        bound=Bound((1.0,), (0.1,), (1.0, 10.0)),
        filters=filters,
    )


def flown(seconds, filters=NOTHING, seed=0):
    """Rate and torque with u = -0.15 y at RATE; plant, wind, noise and filter run four times as often."""
    rng, fine, steps = np.random.default_rng(seed), 0.25 / RATE, int(seconds * RATE)
    pole = np.exp(-2.0 * np.pi * CORNER_HZ * fine)
    d = signal.lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], DISTURBANCE * rng.standard_normal(4 * steps))
    folds = 1.0 if filters is NOTHING else 2.0  # a filter keeps what is sampled from folding down
    white = folds * NOISE * rng.standard_normal(4 * steps)
    whole = model().transfer()
    parts = [signal.cont2discrete(signal.tf2ss(whole.num, whole.den), fine)]
    if filters is not NOTHING:
        parts.append(signal.cont2discrete(signal.tf2ss(filters.num, filters.den), fine, "bilinear"))
    (A, B, C, _, _), shown = parts[0], parts[1:]
    x, x_f, y, u = np.zeros(len(A)), np.zeros(2), np.zeros(steps), np.zeros(steps)
    b, held = np.ravel(B), 0.0
    for k in range(4 * steps):
        rate = (C @ x).item() + white[k]
        for F, G, H, D, _ in shown:
            rate, x_f = (H @ x_f).item() + D.item() * rate, F @ x_f + np.ravel(G) * rate
        if k % 4 == 0:
            held = -0.15 * rate
            y[k // 4], u[k // 4] = rate, held
        x = A @ x + b * (held + d[k])
    return y, u


@pytest.mark.parametrize("filters", [NOTHING, butterworth(40.0)])
def test_noise_and_wind_are_told_apart_in_closed_loop_with_their_intervals(filters):
    found = surroundings([flown(60.0, filters, seed=2)], model(filters), RATE)
    for interval, true in (
        (found.noise_rms, NOISE),
        (found.disturbance_rms, DISTURBANCE),
        (found.corner_hz, CORNER_HZ),
    ):
        assert interval.low < true < interval.high
        assert interval.high / interval.low < 2.5


def test_too_little_to_average_gives_none_and_stretches_add_up():
    y, u = flown(40.0, butterworth(40.0))
    assert surroundings([(y[:4000], u[:4000])], model(), RATE) is None
    halves = [(y[:5000], u[:5000]), (y[5000:], u[5000:])]
    assert surroundings(halves, model(), RATE).windows >= 6

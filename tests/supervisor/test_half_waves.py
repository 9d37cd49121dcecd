"""An oscillation that is not dying, found by its half-waves."""

import numpy as np
import pytest

from dob_companion.supervisor.half_waves import HalfWaves

DT = 0.004
TIMES = np.arange(500) * DT


def recognized(signal, own=1.0, noise=0.001):
    """Index of the sample at which the oscillation is recognized, None when it is not. Values in rad/s."""
    rng = np.random.default_rng(1)
    waves = HalfWaves(DT)
    for k, value in enumerate(signal):
        if waves.add(value + noise * rng.standard_normal(), value, own * value):
            return k
    return None


def growing(hz, factor_a_period, seconds=3.0, start=0.004, most=0.8):
    t = np.arange(0.0, seconds, DT)
    return np.minimum(start * factor_a_period ** (t * hz), most) * np.sin(2.0 * np.pi * hz * t)


@pytest.mark.parametrize("hz", [5.0, 8.0, 16.0, 22.0, 31.0])
@pytest.mark.parametrize("factor", [1.5, 2.0, 3.6])
def test_what_grows_is_recognized_within_two_periods_of_its_rising_above_a_twentieth(hz, factor):
    signal = growing(hz, factor)
    onset = int(np.argmax(np.abs(signal) > 0.05))
    found = recognized(signal)
    assert found is not None
    assert (found - onset) * DT <= 2.0 / hz


def test_what_does_not_grow_but_stays_is_recognized_within_four_periods():
    t = np.arange(0.0, 4.0, DT)
    signal = np.where(t < 2.0, 0.0, 0.1 * np.sin(2.0 * np.pi * 12.0 * t))
    found = recognized(signal)
    assert found is not None
    assert found * DT - 2.0 <= 4.5 / 12.0


@pytest.mark.parametrize(
    ("what", "signal"),
    [
        (
            "a blow that dies",
            0.5 * np.exp(-np.arange(500) * DT / 0.08) * np.sin(2 * np.pi * 12.0 * np.arange(500) * DT),
        ),
        ("too slow", growing(2.0, 2.0)),
        ("too small", growing(16.0, 3.6, most=0.015)),
        ("one swing", np.where(np.arange(500) == 250, 1.0, 0.0)),
    ],
)
def test_what_dies_is_slow_or_is_small_is_none(what, signal):
    assert recognized(signal, noise=1e-4) is None, what


def test_an_oscillation_in_which_our_correction_does_not_swing_is_not_ours_to_end():
    assert recognized(growing(16.0, 3.0), own=0.1) is None
    assert recognized(growing(16.0, 3.0), own=0.5) is not None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("band", [(3.0, 12.0), (1.0, 30.0), (6.0, 20.0)])
def test_chance_is_none_in_ten_minutes_of_noise_of_any_strength(seed, band):
    """Noise in a band, its strength wandering over two decades."""
    rng = np.random.default_rng(seed)
    n = round(600.0 / DT)
    spectrum = np.fft.rfft(rng.standard_normal(n))
    hz = np.fft.rfftfreq(n, DT)
    noise = np.fft.irfft(spectrum / (1.0 + (hz / band[1]) ** 4) / (1.0 + (band[0] / np.maximum(hz, 1e-3)) ** 4), n)
    strength = 10.0 ** np.interp(np.arange(n) * DT, np.arange(0.0, 610.0, 10.0), rng.uniform(-2.5, -0.5, 61))
    waves = HalfWaves(DT)
    signal = strength * noise / noise.std()
    assert not any(waves.add(v, v, v) for v in signal.tolist())


def test_after_a_gap_the_count_begins_anew():
    signal = growing(16.0, 3.0)
    found = recognized(signal)
    waves = HalfWaves(DT)
    for k, value in enumerate(signal[: found + 3].tolist()):
        if k == found - 3:
            waves.clear()
        assert not waves.add(value, value, value)


def test_a_blow_out_of_calm_air_and_what_it_leaves_is_none_and_a_loop_that_rings_from_noise_is():
    """Half-waves of an own plant struck by wind in calm air: alike, growing, and out of nothing."""
    times, peaks = np.arange(9) * DT, (0.12, -0.16, 0.22, -0.26)
    blow = np.concatenate([np.zeros(250), *(peak * np.sin(np.pi * times / times[-1]) for peak in peaks)])
    assert recognized(blow) is None
    assert recognized(growing(12.0, 1.8)) is not None

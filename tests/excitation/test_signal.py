"""The signals: exactly as strong as asked for, in their band, the same again for the same seed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dob_companion.cli import excite
from dob_companion.errors import InputError
from dob_companion.excitation.signal import CHIRP, KINDS, Excitation, table
from tests.effort import examples

DT = 0.004


def power(values, low_hz, high_hz):
    """Share of the power in a band."""
    spectrum, hertz = np.abs(np.fft.rfft(values)) ** 2, np.fft.rfftfreq(len(values), DT)
    return spectrum[(hertz >= low_hz) & (hertz <= high_hz)].sum() / spectrum.sum()


def test_the_command_line_names_the_signals():
    assert excite.SIGNALS == KINDS


@given(
    kind=st.sampled_from(KINDS),
    amplitude=st.floats(1e-3, 0.5),
    seconds=st.floats(5.0, 40.0),
    seed=st.integers(0, 2**31),
    axis=st.integers(0, 2),
)
@settings(max_examples=examples(25), deadline=None)
def test_the_peak_is_the_amplitude_and_the_same_seed_gives_the_same_signal(kind, amplitude, seconds, seed, axis):
    signal = Excitation(kind=kind, seconds=seconds, seed=seed)
    values = table(signal, amplitude, DT, axis)
    assert np.max(np.abs(values)) == amplitude
    assert abs(len(values) * DT - seconds) <= signal.realizations * DT
    np.testing.assert_array_equal(values, table(signal, amplitude, DT, axis))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_multisine_has_the_power_of_a_low_crest_factor(seed):
    values = table(Excitation(seed=seed), 1.0, DT, 1)
    assert 1.0 / np.std(values) < 1.6  # random phases give 3 and more
    assert abs(np.mean(values)) < 0.02


@pytest.mark.parametrize("kind", KINDS)
def test_the_power_lies_in_the_band_and_more_of_it_in_its_low_octaves(kind):
    values = table(Excitation(kind=kind, low_hz=0.5, high_hz=30.0, seconds=20.0), 1.0, DT, 1)
    assert power(values, 0.4, 31.0) > 0.98  # a chirp begins and ends
    octaves = [power(values, low, 2.0 * low) for low in (0.5, 1.0, 2.0, 4.0, 8.0, 15.0)]
    assert min(octaves) > 0.01
    assert octaves[0] >= 0.8 * max(octaves)


def test_another_axis_or_realization_has_other_phases_and_nothing_steps_between_realizations():
    signal = Excitation(seconds=20.0)
    roll, pitch = (table(signal, 1.0, DT, axis) for axis in (0, 1))
    assert signal.realizations == 2
    first, second = np.split(pitch, 2)
    for one, other in ((roll, pitch), (first, second)):
        assert abs(np.corrcoef(one, other)[0, 1]) < 0.5
    steps = np.abs(np.diff(pitch))
    assert steps[2480:2620].max() <= 1.5 * np.delete(steps, slice(2480, 2620)).max()


def test_a_chirp_rises_from_the_lowest_to_the_highest_frequency():
    signal = Excitation(kind=CHIRP, low_hz=1.0, high_hz=32.0, seconds=10.0)
    values = table(signal, 1.0, DT, 0)
    for second, hertz in ((0, 1.2), (4, 4.8), (9, 27.0)):  # of the middle of that second: 2^(t/2)
        piece = values[250 * second : 250 * second + 250]
        crossings = np.sum(np.diff(np.signbit(piece)))
        assert crossings / 2.0 == pytest.approx(hertz, abs=1.0)


@pytest.mark.parametrize(
    ("signal", "named"),
    [
        (Excitation(kind="steps"), "signal 'steps': expected multisine or chirp"),
        (Excitation(seconds=1.0), "seconds 1: expected 2 to 600"),
        (Excitation(low_hz=0.05), "band 0.05 to 100 Hz: expected 0.1 Hz at least"),
        (Excitation(low_hz=100.0), "a rising pair"),
        (Excitation(high_hz=110.0), "100 Hz at most"),
        (Excitation(high_hz=float("nan")), "band"),
        (Excitation(seconds=float("nan")), "seconds nan"),
    ],
)
def test_a_signal_that_cannot_be_made_is_named(signal, named):
    with pytest.raises(InputError, match=named):
        signal.check(DT)

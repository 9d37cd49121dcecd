"""A response drawn around the design's own plant, made stronger and later."""

import numpy as np
import pytest

from dob_companion.identification.agreement import agreement, tolerance, verdict
from dob_companion.identification.result import Response
from dob_companion.lti.response import response
from tests.companion.aircraft import small_design


def drawn(gain, late_s, noise=0.02, seed=0, dt=0.004):
    block = small_design(axes=("pitch",)).blocks[0]
    rng, frequency = np.random.default_rng(seed), np.geomspace(3.0, 200.0, 25)
    true = response(block.problem.plant, frequency * dt)[:, 0, 0] * gain * np.exp(-1j * frequency * late_s)
    deviation = noise * np.abs(true)
    value = true + deviation * (rng.standard_normal(25) + 1j * rng.standard_normal(25)) / np.sqrt(2.0)
    ones = np.ones(25)
    measured = Response(
        frequency=frequency, value=value, deviation=deviation, band=2.0 * deviation, coherence_u=ones,
        coherence_y=ones, averages=9.0 * ones, direct=value, rate_hz=1.0 / dt, instrument="injected", axes=("pitch",),
    )  # fmt: skip
    return block, measured


def test_gain_and_delay_are_in_their_intervals_nineteen_times_of_twenty():
    inside = np.zeros(2)
    for seed in range(200):
        block, measured = drawn(1.2, 0.003, seed=seed)
        found = agreement("pitch", measured, block, 0.004)
        inside += [found.gain.low < 1.2 < found.gain.high, found.delay_s.low < 0.003 < found.delay_s.high]
    assert np.all(inside >= 180)
    assert np.all(inside <= 199)


@pytest.mark.parametrize(
    ("gain", "late_s", "noise", "holds", "words"),
    [
        (1.02, 0.0, 0.02, True, "the model holds: gain 1.0"),
        (1.9, 0.0, 0.02, False, "does not hold: gain 1.9"),
        (0.4, 0.0, 0.02, False, "identify and design again"),
        (1.0, 0.05, 0.02, False, "does not hold"),
        (1.0, 0.0, 3.0, None, "excite for longer"),
    ],
)
def test_the_verdict_is_by_what_the_design_bears(gain, late_s, noise, holds, words):
    block, measured = drawn(gain, late_s, noise)
    told, why = verdict(agreement("pitch", measured, block, 0.004), tolerance(block, 0.004))
    assert told is holds
    assert words in why


def test_too_few_frequencies_say_nothing():
    block, measured = drawn(1.0, 0.0)
    few = {name: getattr(measured, name)[:4] for name in ("frequency", "value", "deviation", "band", "coherence_u")}
    short = Response(
        **few, coherence_y=np.ones(4), averages=np.ones(4), direct=measured.value[:4], rate_hz=250.0,
        instrument="injected", axes=("pitch",),
    )  # fmt: skip
    assert agreement("pitch", short, block, 0.004) is None

"""The example for steady moments."""

import pytest

from dob_companion.synthesis import parse_spec
from tests.px4.steady import EXAMPLE, steady_spec


def test_it_is_the_example_but_for_a_disturbance_that_wanders():
    text = EXAMPLE.read_text(encoding="utf-8")
    example, steady = (parse_spec(each).blocks for each in (text, steady_spec(text)))
    for one, other in zip(example, steady, strict=True):
        assert (other.plant, other.controller) == (one.plant, one.controller)
        assert (other.auto.noise_rms, other.auto.largest_noise) == (one.auto.noise_rms, one.auto.largest_noise)
        assert other.auto.spectrum != one.auto.spectrum
        assert other.auto.disturbance_rms is None


def test_a_spec_without_the_low_pass_is_not_taken_for_done():
    with pytest.raises(ValueError, match="disturbance_corner_hz"):
        steady_spec("[auto]\ndisturbance_band_hz = [0.1, 3.0]\n")

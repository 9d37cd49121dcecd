"""Designs for a moment that is read now and then, flown where it is."""

import pytest

from tests.companion.readings import designed, fly


@pytest.mark.proof
def test_a_design_that_knows_how_often_the_moment_is_read_does_as_it_promises_and_stays_calm_at_high_frequencies():
    knowing, other = designed(), designed("moment_rate_hz = 180", "")
    off = fly(None, 60.0).attitude
    promised = knowing.blocks[0].certificate.extra["attenuation"]
    for loss in (0.0, 0.03):
        mine, its = fly(knowing, 60.0, loss), fly(other, 60.0, loss)
        assert off / mine.attitude > 0.9 * promised
        assert mine.attitude < its.attitude
        assert mine.fast < 0.5 * its.fast

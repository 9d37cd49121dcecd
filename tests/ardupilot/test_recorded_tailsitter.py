"""ArduPlane's tail-sitter on its way to forward flight and back, recorded on the wire by tests.simulators.transition:
0.4 s of hover in a sine and 0.9 s of what follows, and 0.9 s before it hovers again and 0.25 s after."""

from pathlib import Path

import numpy as np
import pytest

from dob_companion.companion import Companion
from dob_companion.companion.config import parse_config
from tests.ardupilot.recorded import frames, messages
from tests.companion.aircraft import small_design

AUTOPILOT, COMPANION = 1, 191
TO_PLANE, TO_MULTICOPTER, MULTICOPTER = 1, 2, 3
CONFIGURATION = Path(__file__).with_name("tailsitter.toml")
WHY = "not in multicopter mode"


def config():
    return parse_config(CONFIGURATION.read_text(), CONFIGURATION.name)


def of(piece, kind, component=AUTOPILOT):
    return [m for m in messages(piece, component) if m.get_type() == kind]


def acts(piece):
    """Stamp in s, correction that acts."""
    return np.array([(1e-6 * m.time_usec, *m.controls[4:7]) for m in of(piece, "ACTUATOR_CONTROL_TARGET")])


def states(piece):
    return [m.vtol_state for m in of(piece, "EXTENDED_SYS_STATE")]


def reasons(piece):
    """What speaks against injecting, after each message of the autopilot's."""
    companion, begin = Companion(small_design(delay_samples=2), config()), None
    for arrival, frame in frames(piece):
        begin = begin or arrival
        if frame[6] == AUTOPILOT:
            companion.receive(frame, arrival - begin)
            companion.advance(arrival - begin)
            companion.bytes_to_send()
            yield companion.loop.regime.why_not(arrival - begin)


def test_on_the_way_out_what_acts_is_gone_in_a_moment_and_exactly_zero_from_then_on():
    assert states("tailsitter_away")[0] == MULTICOPTER
    assert states("tailsitter_away")[-1] == TO_PLANE
    assert any(m.text == "DOBC: not in hover" for m in of("tailsitter_away", "STATUSTEXT"))
    rows = acts("tailsitter_away")
    largest = np.abs(rows[:, 1:]).max(axis=1)
    gone = int(np.flatnonzero(largest)[-1]) + 1
    assert largest[0] > 0.015
    assert 0.4 < rows[gone, 0] - rows[0, 0] < 0.6
    assert len(rows) - gone > 100
    asked = of("tailsitter_away", "DEBUG_VECT", COMPANION)
    assert max(abs(v) for v in (asked[-1].x, asked[-1].y, asked[-1].z)) == 0.0


def test_until_it_hovers_again_nothing_acts():
    assert states("tailsitter_back")[0] == TO_MULTICOPTER
    assert states("tailsitter_back")[-1] == MULTICOPTER
    rows = acts("tailsitter_back")
    assert np.all(rows[rows[:, 0] - rows[0, 0] < 0.8, 1:] == 0.0)


def test_the_companion_says_why_and_when_it_is_over():
    away, back = list(reasons("tailsitter_away")), list(reasons("tailsitter_back"))
    assert (WHY in away, away[-1]) == (True, WHY)
    assert (WHY in back, back[-1] == WHY) == (True, False)


def test_in_hover_gravity_is_down_in_the_axes_of_the_configuration():
    felt = np.array([(m.xacc, m.yacc, m.zacc) for m in of("tailsitter_away", "HIGHRES_IMU")][:75]).mean(axis=0)
    assert config().axes.gyro.inward(tuple(felt)) == pytest.approx((0.0, 0.0, -9.8), abs=0.6)

"""What ArduCopter and the script on board have said on the wire, heard again."""

import numpy as np
import pytest

from dob_companion.companion import Companion
from tests.ardupilot.recorded import PIECES, frames, messages
from tests.companion.aircraft import small_design

AUTOPILOT, COMPANION, DT_US = 1, 191, 4000


def of(piece, kind, component):
    return [m for m in messages(piece, component) if m.get_type() == kind]


@pytest.mark.parametrize("piece", PIECES)
def test_the_companion_understands_everything_that_the_autopilot_says(piece):
    companion, begin = Companion(small_design(delay_samples=2)), None
    for arrival, frame in frames(piece):
        begin = begin or arrival
        if frame[6] == AUTOPILOT:
            companion.receive(frame, arrival - begin)
            companion.advance(arrival - begin)
            companion.bytes_to_send()
    status = companion.status()
    assert companion.vehicle == 1
    assert status.bad == 0
    assert status.rate_hz == 0.0 or status.rate_hz == pytest.approx(250.0, rel=0.05)


@pytest.mark.parametrize("piece", ["copter_enable", "copter_sine"])
def test_every_answer_leads_back_to_the_correction_that_it_contains(piece):
    sent = {m.time_usec: (m.x, m.y, m.z) for m in of(piece, "DEBUG_VECT", COMPANION) if m.name == "DOB_CORR"}
    found = 0
    for m in of(piece, "ACTUATOR_CONTROL_TARGET", AUTOPILOT):
        answered = m.time_usec - round(m.controls[7] * DT_US)
        if answered in sent:
            found += 1
            assert np.allclose(m.controls[4:7], sent[answered], rtol=0.0, atol=1e-6)
    assert found > 500


@pytest.mark.parametrize("piece", ["copter_enable", "copter_sine"])
def test_moments_are_irregular_but_in_order_and_within_their_range(piece):
    answers = of(piece, "ACTUATOR_CONTROL_TARGET", AUTOPILOT)
    steps = np.diff([m.time_usec for m in answers])
    controls = np.array([m.controls for m in answers])
    assert np.all(steps > 0)
    assert np.max(steps) > 2 * DT_US
    assert np.all(np.abs(controls[:, :7]) <= 1.0)
    assert 0.5 < np.median(controls[:, 7]) < 3.0


def test_the_observer_takes_over_from_the_integrator_of_the_rate_controller():
    sine = of("copter_sine", "ACTUATOR_CONTROL_TARGET", AUTOPILOT)
    whole, contained = (np.array([m.controls[i] for m in sine]) for i in (0, 4))
    assert np.sqrt(np.mean((whole - contained) ** 2)) < 0.2 * np.sqrt(np.mean(contained**2))


def test_a_stream_that_only_the_script_has_is_refused_by_the_autopilot():
    acknowledged = [m.result for m in of("copter_hello", "COMMAND_ACK", AUTOPILOT) if m.command == 511]
    assert acknowledged == [0, 2, 0]  # HIGHRES_IMU, ACTUATOR_CONTROL_TARGET, EXTENDED_SYS_STATE

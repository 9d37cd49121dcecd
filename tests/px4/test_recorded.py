"""What PX4 with the module on board has said on the wire, heard again.

Pieces of telemetry logs in tests/data/px4, recorded by `dob-companion run --record` beside PX4's simulator: first
contact on the ground; DOB_ENABLE written by a ground station through the autopilot, in hover; ACTIVE under a sine of
0.5 Hz and 6 rad/s² about roll.
"""

from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import Companion
from dob_companion.mavlink.tunnel import correction_in
from tests.ardupilot.recorded import frames, messages
from tests.companion.aircraft import small_design

DATA = Path(__file__).parents[1] / "data" / "px4"
PIECES = ("sih_hello", "sih_enable", "sih_sine")
AUTOPILOT, COMPANION, SET_MESSAGE_INTERVAL = 1, 191, 511


def of(piece, kind, component):
    return [m for m in messages(piece, component, DATA) if m.get_type() == kind]


def reports(piece):
    return [m for m in of(piece, "DEBUG_FLOAT_ARRAY", AUTOPILOT) if m.name == "DOB_ACT"]


def sent(piece):
    return dict(filter(None, map(correction_in, of(piece, "TUNNEL", COMPANION))))


@pytest.mark.parametrize("piece", PIECES)
def test_the_companion_understands_what_the_autopilot_says(piece):
    companion, begin = Companion(small_design(delay_samples=2)), None
    dialects = set()
    for arrival, frame in frames(piece, DATA):
        begin = begin or arrival
        if frame[6] == AUTOPILOT:
            dialects.add(int.from_bytes(frame[7:10], "little") in mav.mavlink_map)
            companion.receive(frame, arrival - begin)
            companion.advance(arrival - begin)
            companion.bytes_to_send()
    status = companion.status()
    assert (companion.vehicle, companion.profile.name) == (1, "px4")
    assert (status.bad, dialects) == (0, {True, False})  # what PX4 sends of its own is of no use here and no fault
    assert status.rate_hz == 0.0 or status.rate_hz == pytest.approx(250.0, rel=0.06)


@pytest.mark.parametrize("piece", ["sih_enable", "sih_sine"])
def test_every_report_leads_back_to_the_correction_that_it_contains(piece):
    corrections, whole = sent(piece), 0
    for m in reports(piece):
        answered = m.time_usec - round(m.data[7])
        if answered in corrections:
            assert np.all(np.abs(m.data[4:7]) <= np.abs(corrections[answered]) + 1e-6)
            whole += np.allclose(m.data[4:7], corrections[answered], rtol=0.0, atol=1e-6)
    assert whole > 0.9 * len(reports(piece)) - 5


@pytest.mark.parametrize("piece", ["sih_enable", "sih_sine"])
def test_reports_are_in_order_and_a_sample_or_two_old(piece):
    data = np.array([(m.time_usec, *m.data[:8]) for m in reports(piece)])
    assert np.all(np.diff(data[:, 0]) >= 0.0)
    assert round(np.median(data[:, 8])) in (4000, 8000)
    assert np.all(np.abs(data[:, 1:8]) <= 1.0)


def test_the_telemetry_of_the_companion_does_not_take_the_place_of_reports():
    stamps = [m.time_usec for m in reports("sih_sine")]
    told = of("sih_sine", "DEBUG_FLOAT_ARRAY", COMPANION)
    assert len(told) > 100
    assert len({*stamps}) > 0.97 * 250e-6 * (stamps[-1] - stamps[0])


def test_the_autopilot_grants_every_stream():
    acknowledged = [m.result for m in of("sih_hello", "COMMAND_ACK", AUTOPILOT) if m.command == SET_MESSAGE_INTERVAL]
    assert len(acknowledged) >= 3
    assert {*acknowledged} == {0}

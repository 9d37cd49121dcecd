"""A cut from companion to vehicle, recorded beside both simulators by tests.simulators.hardship: 0.3 s before, 0.6 s
after. The pieces hold what reached the autopilot and what it reported; the model of a vehicle's take-up that the tests
in simulated time fly with has to do the same."""

import struct
from pathlib import Path

import numpy as np
import pytest

from tests.ardupilot.recorded import frames
from tests.companion.takeup import TakeUp
from tests.simulators.aircraft import AIRCRAFT, correction

DATA = Path(__file__).parents[1] / "data"
PIECES = {"ardupilot": "copter_unheard", "px4": "sih_unheard"}
LATE_S = 0.02
"""How long a message is under way at most, and how often it is reported what acts, together."""


@pytest.fixture(scope="module", params=PIECES)
def recorded(request):
    """Arrival s, stamp µs and roll of the corrections that reached it; arrival s, stamp s, correction of reports."""
    asked, acts = [], []
    for arrival, frame in frames(PIECES[request.param], DATA / request.param):
        if found := correction(frame):
            asked.append((arrival, *found))
        if row := AIRCRAFT[request.param].applied(frame):
            acts.append((arrival, row[0], *row[4:]))
    return asked, np.array(acts)


def test_what_acts_never_grows_and_is_zero_a_fifth_of_a_second_after_the_last_news(recorded):
    asked, acts = recorded
    after = acts[acts[:, 0] > asked[-1][0] + LATE_S]
    assert np.abs(after[0, 2:]).max() > 1e-3
    assert np.all(np.diff(np.abs(after[:, 2:]), axis=0) <= 1e-9)
    assert np.all(after[after[:, 0] > asked[-1][0] + 0.2 + LATE_S, 2:] == 0.0)


def test_the_model_of_the_take_up_does_the_same(recorded):
    asked, acts = recorded
    ahead = np.median(acts[:, 1] - acts[:, 0])  # of the vehicle's clock
    model = TakeUp()
    for arrival, stamp, value in asked:
        model.takes(stamp, value, round(1e6 * (arrival + ahead + LATE_S)))
    after = acts[acts[:, 0] > asked[-1][0] + 2.0 * LATE_S]
    there = np.array([model.at(round(1e6 * row[1]))[0] for row in after])
    largest = np.abs(after[0, 2:]).max()
    assert np.all(np.abs(there - after[:, 2:]) <= largest * 1.5 * LATE_S / 0.1)
    assert len(after) > 50


def test_a_report_and_a_correction_are_told_from_other_messages():
    beat = bytes([0xFD, 1, 0, 0, 0, 1, 1, 0, 0, 0]) + bytes(3)
    named_otherwise = bytes([0xFD, 18, 0, 0, 0, 1, 1, 94, 1, 0]) + struct.pack("<QH", 1, 0) + b"OTHER\0\0\0" + bytes(2)
    for aircraft in AIRCRAFT.values():
        assert aircraft.applied(beat) is None
        assert aircraft.applied(named_otherwise) is None
    assert correction(beat) is None

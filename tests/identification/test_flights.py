"""Several flights of one aircraft, taken together; and of two aircraft, which are told apart."""

from dataclasses import replace

import numpy as np
import pytest

from dob_companion.identification.identify import identify
from dob_companion.identification.surroundings import around
from tests.identification.hovering import Axis, fly, record

PITCH = Axis()
SECONDS = 30


def flown(name, seed, axis=PITCH, **changes):
    return record(fly([axis] * 3, SECONDS, seed), source=name, **changes)


def width(found):
    gain = found.axes["pitch"].model.acceleration_per_unit
    return gain.high - gain.low


def test_intervals_of_three_flights_are_narrower_than_those_of_each_and_hold_the_truth():
    records = [flown(f"{seed}.tlog", seed) for seed in (1, 2, 3)]
    each = [identify(one, axes=("pitch",)) for one in records]
    together = identify(records, axes=("pitch",))
    gain = together.axes["pitch"].model.acceleration_per_unit
    assert together.usable == ("pitch",)
    assert width(together) < 0.8 * min(map(width, each))
    assert gain.low <= PITCH.gain <= gain.high
    model = together.axes["pitch"].model
    hertz = np.geomspace(0.3, 30.0, 100)
    truth = PITCH.held(2.0 * np.pi * hertz, 0.004)
    assert np.all(np.abs(truth / model.response(2.0 * np.pi * hertz, 250.0) - 1.0) <= model.bound.at(hertz))
    assert around(records, together)["pitch"] is not None


def test_they_stand_one_behind_the_other_and_no_segment_crosses_from_one_to_the_next():
    found = identify([flown("a", 1), flown("b", 2)], axes=("pitch",))
    used = [segment for segment in found.segments if segment.axes]
    assert len(used) == 2
    assert used[0].end <= SECONDS <= used[1].begin
    assert f"b: from {SECONDS:.1f} s on below" in found.remarks


def test_one_without_excitation_adds_nothing_and_spoils_nothing():
    quiet = flown("quiet", 2, replace(PITCH, injected=1e-9))
    quiet = replace(quiet, injected=None)
    alone = identify(flown("a", 1), axes=("pitch",)).axes["pitch"].model
    both = identify([quiet, flown("a", 1)], axes=("pitch",)).axes["pitch"].model
    assert both.acceleration_per_unit.value == pytest.approx(alone.acceleration_per_unit.value, rel=0.01)


@pytest.mark.parametrize(
    ("other", "why"),
    [
        ({"axis": replace(PITCH, gain=340.0)}, "the records contradict each other: gain of the common model's a"),
        ({"axis": replace(PITCH, delay=0.016)}, "the records contradict each other: delay beyond the common model's a"),
        ({"vehicle": "hexarotor"}, "a is of vehicle 'quadrotor', b of 'hexarotor': not one aircraft"),
        ({"rates_filtered": False}, "not taken at the same side of the gyro filter"),
        ({"parameters": {"INS_GYRO_FILTER": 40.0}}, "a and b were flown with different gyro filters"),
        ({"vehicle": "rover"}, "b: a rover does not hover"),
    ],
)
def test_what_cannot_be_of_one_aircraft_is_refused_with_the_reason(other, why):
    said = {
        "make": "ArduPilot",
        "vehicle": "quadrotor",
        "rates_filtered": True,
        "parameters": {"INS_GYRO_FILTER": 20.0},
    }
    if "axis" in other:
        said = {}
    pair = [flown("a", 1, **said), flown("b", 2, **(said | other))]
    found = identify(pair, axes=("pitch",))
    assert not found.usable
    assert why in found.axes["pitch"].why


def test_a_little_difference_from_flight_to_flight_widens_gain_and_bound():
    same = identify([flown("a", 1), flown("b", 2)], axes=("pitch",))
    heavier = identify([flown("a", 1), flown("b", 2, replace(PITCH, gain=215.0))], axes=("pitch",))
    assert heavier.usable == ("pitch",)
    gain = heavier.axes["pitch"].model.acceleration_per_unit
    assert gain.low <= 215.0
    assert gain.high >= 250.0
    assert width(heavier) > 1.5 * width(same)

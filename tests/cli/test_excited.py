"""What `excite` leaves beside a log, and what becomes of the delay that it has measured."""

import json

import pytest

from dob_companion.autopilots import Sourced
from dob_companion.cli.excited import beside, link_delay
from dob_companion.errors import InputError
from dob_companion.identification.controllers import Controllers

MEASURED = {"median_samples": 2, "p95_samples": 3, "source": "TIMESYNC round trip", "round_trip_s": 0.009}


def left(folder, **more):
    content = {"schema": "dob-companion/excitation/1", "log": "excite.tlog", "parameters": {"A": 1}} | more
    (folder / "excite.json").write_text(json.dumps(content), encoding="utf-8")
    return folder / "excite.tlog"


def of(delay, least=1):
    return Controllers(
        lines={}, attitude_gain=Sourced(6.5, ""), delay_samples=Sourced(delay, "beforehand"), least_delay=least
    )


def test_the_delay_is_what_95_percent_do_not_exceed_and_says_how_it_was_measured(tmp_path):
    found = beside(left(tmp_path, delay=MEASURED))
    assert found.parameters == {"A": 1.0}
    said = link_delay(None, found.delay, of(5))
    assert said.value == 3
    assert said.source == "measured while it was excited: 95 % within 3, median 2; TIMESYNC round trip"


def test_what_was_given_comes_first_and_no_measurement_goes_below_what_the_autopilot_needs():
    measured = Sourced(1, "measured")
    assert link_delay(4, measured, of(2, least=2)) == Sourced(4, "given")
    assert link_delay(None, measured, of(2, least=2)) == Sourced(2, "least for this autopilot; measured")
    assert link_delay(None, None, of(2, least=2)) == Sourced(2, "beforehand")


def test_an_older_one_without_a_delay_serves_and_one_of_another_log_does_not_count(tmp_path):
    assert beside(left(tmp_path)).delay is None
    assert beside(left(tmp_path, delay=MEASURED | {"median_samples": None, "p95_samples": None})).delay is None
    assert beside(tmp_path / "another.tlog") is None
    assert beside(tmp_path / "elsewhere" / "excite.tlog") is None


@pytest.mark.parametrize("damage", [{"parameters": []}, {"schema": "other"}, {"delay": {"p95_samples": "two"}}])
def test_a_damaged_one_is_one_line_that_names_it(tmp_path, damage):
    with pytest.raises(InputError, match=r"excite\.json: expected what `dob-companion excite` writes"):
        beside(left(tmp_path, **damage))

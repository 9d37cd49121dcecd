"""Cuts, stalls and lost messages, judged by what acts on the vehicle (docs/interfaces.md, Taking up a correction)."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dob_companion.companion import Companion, CompanionConfig
from dob_companion.supervisor import State
from tests.companion.aircraft import DT, Kept, corrections, small_design, texts
from tests.companion.takeup import DT_US, TakeUp, TakingAircraft
from tests.effort import a_few, examples

WIND = 0.1


def in_flight():
    """Active, with a steady correction of -0.1 about roll acting on the vehicle."""
    return _kept().again()


@cache
def _kept():
    plane = TakingAircraft(Companion(small_design(), CompanionConfig()), takeup=TakeUp(largest=WIND))
    plane.active()
    plane.wind = (WIND, 0.0, 0.0)
    plane.pairs(60)
    assert plane.applied[-1][0] == pytest.approx(-WIND, rel=1e-3)
    return Kept(plane)


def sizes(plane, since):
    return np.abs([moment[0] for moment in plane.applied[since:]])


@pytest.mark.parametrize("way", ["down", "up", "both"])
@pytest.mark.parametrize("samples", a_few([10, 21, 24, 30, 45, 80, 140, 400], every=3))
def test_after_a_cut_in_either_direction_what_acts_never_rises_before_a_ramp_in(way, samples):
    plane = in_flight()
    since = len(plane.applied)
    plane.down, plane.up = way == "up", way == "down"
    plane.pairs(samples)
    plane.down = plane.up = True
    plane.until(State.RAMP_IN if plane.takeup.timeouts else State.ACTIVE)
    until_ramp_in = sizes(plane, since)
    if plane.takeup.timeouts:
        assert np.all(np.diff(until_ramp_in) <= 1e-6)
        assert until_ramp_in[-1] == 0.0
    plane.until(State.ACTIVE)
    plane.pairs(60)
    assert plane.takeup.wrong == []
    assert plane.applied[-1][0] == pytest.approx(-WIND, rel=1e-3)
    assert (plane.takeup.timeouts > 0) == (samples >= 25)


def test_corrections_that_do_not_arrive_are_noticed_before_the_vehicle_times_out_and_said():
    plane = in_flight()
    plane.up = False
    sent = [c.x for c in plane.pairs(50)]
    assert sent[24:] == [0.0] * 26
    assert plane.takeup.timeouts == 1
    assert "DOB RAMP_OUT: corrections do not reach the vehicle" in texts(plane.said)
    assert plane.companion.status().why == "corrections do not reach the vehicle"
    plane.pairs(1000)
    assert not plane.companion.status().state.injecting  # no ramp-in that nobody hears


def test_a_vehicle_that_reports_no_correction_any_more_gets_a_ramp_in():
    plane = in_flight()
    plane.takeup.stamp = None
    plane.pairs(3)
    assert plane.companion.status().correction == (0.0, 0.0, 0.0)
    plane.until(State.ACTIVE)


def test_a_vehicle_that_starts_anew_gets_nothing_of_the_old_correction():
    plane = in_flight()
    plane.sample -= 600
    plane.takeup.restart()
    sent = plane.pairs(200)
    assert {(c.x, c.y, c.z) for c in sent} == {(0.0, 0.0, 0.0)}
    plane.until(State.ACTIVE)
    assert plane.takeup.wrong == []


@pytest.mark.parametrize("pause", [0.09, 0.3, 0.49])
def test_a_vehicle_that_waits_in_lockstep_does_not_age_and_goes_on_as_if_nothing_had_been(pause):
    plane, other = in_flight(), in_flight()
    for _ in range(5):
        plane.silence(pause)
        assert [(c.time_usec, c.x, c.y, c.z) for c in plane.pairs(3)] == [
            (c.time_usec, c.x, c.y, c.z) for c in other.pairs(3)
        ]
    assert plane.companion.status().state is State.ACTIVE


# Backlogs ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [4, 12, 20, 25, 40, 100, 150])
def test_of_a_backlog_no_sample_older_than_the_design_allows_is_answered_but_by_zero(samples):
    plane = in_flight()
    since, stepped = len(plane.applied), plane.companion.status().stepped
    answers = plane.stalled(samples)
    newest = plane.stamp - DT_US
    late = [c for c in answers if c.time_usec < newest - 2 * DT_US]
    assert answers[-1].time_usec == newest
    assert all((c.x, c.y, c.z) == (0.0, 0.0, 0.0) for c in late)
    assert plane.companion.status().stepped == stepped + samples
    plane.pairs(20)
    if samples >= 25:
        assert np.all(np.diff(sizes(plane, since)) <= 1e-6)
        assert any("vehicle without answers for" in text for text in texts(plane.said))
    else:
        assert np.min(sizes(plane, since)) > 0.9 * WIND
        assert plane.companion.status().state is State.ACTIVE
    plane.until(State.ACTIVE)
    assert plane.takeup.wrong == []


def test_a_short_backlog_is_answered_whole_and_a_backlog_of_zeros_too():
    plane = in_flight()
    assert len(plane.stalled(3)) == 3
    plane.write("DOB_ENABLE", 0.0)
    plane.pairs(200)
    assert len(plane.stalled(60)) == 60


# Everything at once -----------------------------------------------------------------------------------------------

spells = st.one_of(
    st.tuples(st.just("fly"), st.integers(1, 300)),
    st.tuples(st.just("down"), st.integers(1, 150)),
    st.tuples(st.just("up"), st.integers(1, 150)),
    st.tuples(st.just("both"), st.integers(1, 150)),
    st.tuples(st.just("stall"), st.integers(1, 150)),
    st.tuples(st.just("wait"), st.integers(1, 120)),
    st.tuples(st.just("lossy"), st.integers(1, 150)),
    st.tuples(st.just("skip"), st.integers(1, 60)),
    st.tuples(st.just("off"), st.integers(1, 150)),
    st.tuples(st.just("on"), st.integers(1, 150)),
)


def live(plane, what, count, rng):
    """One spell of a flight."""
    plane.down = plane.up = True
    match what:
        case "down" | "up" | "both":
            plane.down, plane.up = what == "up", what == "down"
            plane.pairs(count)
        case "stall":
            plane.stalled(count)
        case "wait":
            plane.silence(0.004 * count)
        case "lossy":
            for _ in range(count):
                plane.down, plane.up = (rng.random(2) < 0.6).tolist()
                plane.pair()
        case "skip":
            plane.sample, plane.now = plane.sample + count, plane.now + DT * count
        case "off" | "on":
            plane.write("DOB_ENABLE", float(what == "on"))
            plane.pairs(count)
        case _:
            plane.pairs(count)


def test_a_cut_to_the_vehicle_that_a_cut_from_it_follows_is_reckoned_as_one():
    """Four answers lost, then 21 samples that nobody hears: neither is too long, both together are."""
    judged([("up", 4), ("down", 21)], 0)


flights = given(st.lists(spells, max_size=12), st.integers(0, 2**32 - 1))


@settings(max_examples=examples(30), deadline=None)
@flights
def test_whatever_the_link_does_nothing_but_zero_reaches_a_vehicle_that_has_timed_out_until_a_ramp_in(flight, seed):
    judged(flight, seed)


@pytest.mark.proof
@settings(max_examples=500, deadline=None, print_blob=True)
@flights
def test_hundreds_of_bad_links_bring_nothing_but_zero_to_a_vehicle_that_has_timed_out_until_a_ramp_in(flight, seed):
    judged(flight, seed)


def judged(flight, seed):
    plane, rng = in_flight(), np.random.default_rng(seed)
    for what, count in [*flight, ("fly", 50)]:
        live(plane, what, count, rng)
    assert plane.takeup.wrong == []
    assert all(abs(c.x) <= WIND + 1e-6 for c in corrections(plane.said)[-50:])

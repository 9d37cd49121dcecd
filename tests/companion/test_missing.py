"""Samples that are missing, late or irregular: bridged within the design's bound, faded beyond it."""

from itertools import pairwise

import numpy as np
import pytest

from dob_companion.companion.dob import DobLoop
from dob_companion.companion.parameters import Parameters
from dob_companion.mavlink import AppliedMoment, Codec, GyroSample, profiles
from dob_companion.observer import ObserverBank, missing_samples
from dob_companion.observer.missing import HELD
from dob_companion.supervisor import State
from tests.ardupilot.recorded import frames
from tests.companion.aircraft import DT, aircraft, small_design, texts
from tests.effort import a_few
from tests.observer.designs import designed
from tests.observer.test_missing import drawn, flight_of

DT_US = round(1e6 * DT)
BOUND = missing_samples(small_design())


def loop_of(design):
    return DobLoop(design, Parameters())


def stamped(k):
    return 5_000_000 + k * DT_US


def flown(design, y, u, *, gyro_lost=(), moments_lost=(), late=0):
    """d_hat of one axis, by sample, of a loop that is told of a flight with some of it missing or late."""
    loop, axis = loop_of(design), design.blocks[0].axes[0]
    index, on_the_way, found = ("roll", "pitch", "yaw").index(axis), [], {}
    for k in range(len(y)):
        rates, moment = [0.0] * 3, [0.0] * 3
        rates[index], moment[index] = float(y[k]), float(u[k])
        if k not in gyro_lost:
            loop.gyro(GyroSample(stamped(k), tuple(rates)), 0.0)
            found[k] = loop.d_hat[index]
        on_the_way.append((k, tuple(moment)))
        while on_the_way and on_the_way[0][0] <= k - late:
            j, value = on_the_way.pop(0)
            if j not in moments_lost:
                loop.moment(AppliedMoment(stamped(j), value, 0.5, (0.0, 0.0, 0.0), 1.0))
        loop.follow_up()
    return loop, found


@pytest.fixture(scope="module", params=a_few(["ardupilot", "tuned", "paper"], every=3))
def told(request):
    """A design, and a flight of its own first axis."""
    design = designed(request.param)
    y, u, _ = drawn(design.blocks[0], 3000, seed=3)
    return design, y, u


def reference(design, y, u):
    """The observer alone, fed with all there is."""
    bank, axis = ObserverBank(design), ("roll", "pitch", "yaw").index(design.blocks[0].axes[0])
    found = []
    for rate, moment in zip(y, u, strict=True):
        rates, moments = [0.0] * 3, [0.0] * 3
        rates[axis], moments[axis] = float(rate), float(moment)
        found.append(bank.estimate(tuple(rates))[axis])
        bank.advance(tuple(rates), tuple(moments))
    return np.array(found)


def differences(design, y, u, begin=500, **missing):
    loop, found = flown(design, y, u, **missing)
    whole = reference(design, y, u)
    return loop, np.array([found[k] - whole[k] for k in found if k >= begin])


def foreseen(block, bound):
    """The largest addition to the error that the bound allows, as the design foresees it."""
    flight = flight_of(block, max(bound) + 2)
    return max(float(flight.without_pairs(bound.samples)[0]), float(flight.without_moments(bound.moments)[0]))


def test_with_nothing_missing_it_is_the_observer_alone(told):
    design, y, u = told
    loop, off = differences(design, y, u, begin=1)
    assert np.max(np.abs(off)) < 1e-9 * np.max(np.abs(reference(design, y, u)))
    assert (loop.samples.counters.bridged, loop.samples.counters.gaps) == (0, 0)


def test_lost_pairs_within_the_bound_are_no_gap_and_cost_no_more_than_it_says(told):
    design, y, u = told
    bound, rng, lost, at = missing_samples(design), np.random.default_rng(2), set(), 600
    while at < len(y) - 50:
        run = int(rng.integers(1, bound.samples + 1))
        lost |= set(range(at, at + run))
        at += run + 4 * run + int(rng.integers(10, 60))
    loop, off = differences(design, y, u, gyro_lost=lost, moments_lost=lost)
    assert loop.samples.counters.gaps == 0
    assert np.all(np.isfinite(off))
    assert np.sqrt(np.mean(off**2)) <= foreseen(design.blocks[0], bound)


@pytest.mark.proof
@pytest.mark.parametrize("missing", [2, 5])
def test_lost_moments_cost_what_the_design_foresees(missing):
    design, period = designed("tuned"), 60
    y, u, _ = drawn(design.blocks[0], 12_000, seed=4)
    lost = {at + k for at in range(540, len(y), period) for k in range(missing)}
    _, off = differences(design, y, u, begin=540, moments_lost=lost)
    by_phase = off[: len(off) // period * period].reshape(-1, period)
    found = np.max(np.sqrt(np.mean(by_phase**2, axis=0)))
    assert found == pytest.approx(flight_of(design.blocks[0], 8).without_moments(missing)[0], rel=0.15)


def test_moments_that_always_come_late_by_no_more_than_are_held_are_no_gap(told):
    design, y, u = told
    bound = missing_samples(design)
    loop, off = differences(design, y, u, late=min(bound.moments, HELD))
    assert loop.samples.counters.gaps <= bound.moments  # before the first has come
    assert np.sqrt(np.mean(off**2)) <= foreseen(design.blocks[0], bound)


def test_late_moments_are_made_up_for_as_soon_as_they_have_come(told):
    design, y, u = told
    late = set(range(1000, 1000 + missing_samples(design).moments))
    loop = loop_of(design)
    axis = ("roll", "pitch", "yaw").index(design.blocks[0].axes[0])
    for k in range(1010 + len(late)):
        rates, moment = [0.0] * 3, [0.0] * 3
        rates[axis] = float(y[k])
        loop.gyro(GyroSample(stamped(k), tuple(rates)), 0.0)
        due = [k] if k not in late else []
        if k == max(late):
            due = sorted(late)
        for j in due:
            moment[axis] = float(u[j])
            loop.moment(AppliedMoment(stamped(j), tuple(moment), 0.5, (0.0, 0.0, 0.0), 1.0))
    assert loop.samples.counters.gaps == 0
    assert loop.d_hat[axis] == pytest.approx(reference(design, y, u)[1009 + len(late)], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", ["tuned", "ardupilot"])
def test_a_script_that_answers_irregularly_is_no_fault(name):
    loop, codec, begin = loop_of(designed(name)), Codec(1, profile=profiles.at_first("ardupilot")), None
    estimates = []
    for arrival, frame in frames("copter_irregular"):
        begin = begin or arrival
        for fact in codec.facts(frame):
            match fact:
                case GyroSample():
                    loop.gyro(fact, arrival - begin)
                    estimates.append(loop.d_hat)
                case AppliedMoment():
                    loop.moment(fact)
    assert loop.samples.counters.gaps <= (2 if name == "ardupilot" else 60)
    assert np.all(np.isfinite(estimates))
    if name == "ardupilot":
        assert np.max(np.abs(estimates[500:])) < 0.3


def in_flight():
    plane = aircraft().active()
    plane.rates = (0.1, 0.1, 0.1)
    plane.pairs(100)
    plane.said.clear()
    return plane


def test_the_longest_run_that_the_bound_allows_leaves_it_active():
    plane = in_flight()
    plane.sample += BOUND.samples
    (answer,) = plane.pair()
    plane.pairs(50)
    assert plane.companion.status().state is State.ACTIVE
    assert answer.x == pytest.approx(-0.1, abs=1e-3)
    assert texts(plane.said) == []


def test_one_more_fades_from_no_more_than_was_sent_nor_than_what_the_gap_leaves_likely():
    for rate, most in ((0.1, 0.1), (0.3, 0.1), (0.02, 0.1), (-0.2, 0.0)):
        plane = in_flight()
        plane.sample += BOUND.samples + 1
        plane.rates = (rate, 0.1, 0.1)
        answers = [plane.pair()[0].x for _ in range(130)]
        assert any("gap in samples" in text for text in texts(plane.said))
        fade = answers[:126]  # then it fades in again
        assert all(-most <= x <= 0.0 for x in fade)
        assert all(abs(after) <= abs(before) for before, after in pairwise(fade))

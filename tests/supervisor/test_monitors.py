"""What a link is worth: rate, delay, hysteresis."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dob_companion.supervisor import DelayMonitor, Hysteresis, LinkGate, RateMonitor, RoundTrip
from dob_companion.supervisor.monitors import UNKNOWN_AGE

DT_US = 4000


def gate_after(ages, stamps=None, delay=1, margin=3):
    gate = LinkGate(250.0, delay, margin)
    stamps = np.arange(len(ages)) * DT_US if stamps is None else stamps
    for k, (stamp, age) in enumerate(zip(stamps, ages, strict=True)):
        gate.rate.add(int(stamp))
        gate.delay.add(int(stamp), age)
        if k % 25 == 24:
            gate.judge(int(stamp))
    return gate


def test_a_link_at_full_rate_and_the_designed_delay_is_good():
    assert gate_after([1] * 800).good


def test_a_link_is_not_good_before_two_seconds_were_seen():
    assert not gate_after([1] * 400).good


@pytest.mark.parametrize(("kept", "good"), [(0.97, True), (0.93, False)])
def test_injecting_does_not_begin_below_95_percent_of_the_rate(kept, good):
    rng = np.random.default_rng(3)
    stamps = np.sort(rng.choice(1200, int(1200 * kept), replace=False)) * DT_US
    assert gate_after([1] * len(stamps), stamps).good is good


@pytest.mark.parametrize(
    ("kept", "told", "good"), [(0.8, True, True), (0.8, False, False), (0.97, False, True), (0.7, True, False)]
)
def test_once_injecting_samples_that_are_lost_on_the_way_are_no_lower_rate(kept, told, good):
    """`told`: as samples that were lost. Otherwise it is a vehicle that sends more slowly."""
    gate = gate_after([1] * 900)
    lost = np.random.default_rng(5).random(1500) >= kept
    before = 899
    for k in np.flatnonzero(~lost) + 900:
        gate.rate.add(int(k) * DT_US, int(k - before - 1) if told else 0)
        gate.delay.add(int(k) * DT_US, 1)
        gate.judge(int(k) * DT_US)
        before = k
    assert gate.good is good
    assert gate.rate.hz == pytest.approx(250.0 * kept, rel=0.05)
    assert not told or gate.rate.sent_hz == pytest.approx(250.0, rel=0.01)


@pytest.mark.parametrize(("delay", "good"), [(1, True), (2, True), (3, False)])
def test_the_median_delay_may_exceed_the_design_by_one_sample(delay, good):
    gate = gate_after([delay] * 900)
    assert gate.good is good
    assert gate.delay_median == delay


@pytest.mark.parametrize(("share", "good"), [(0.04, True), (0.07, False)])
def test_five_percent_of_the_samples_may_be_later_than_the_delay_margin(share, good):
    ages = [5 if (k % 100) < 100 * share else 1 for k in range(900)]
    assert gate_after(ages).good is good


@pytest.mark.parametrize("age", [-1.0, float("nan"), float("inf"), 1e9])
def test_a_delay_that_the_vehicle_does_not_know_is_not_good(age):
    gate = gate_after([age] * 900)
    assert not gate.good
    assert "no delay" in gate.why


@pytest.mark.parametrize(
    ("late", "share", "told"),
    [(1, 1.0, ""), (2, 0.04, ""), (2, 0.07, "delay p95 2 samples, designed for 1"), (9, 1.0, "")],
)
def test_delay_beyond_the_design_is_told_of_a_link_that_is_good_enough(late, share, told):
    assert gate_after([late if (k % 100) < 100 * share else 1 for k in range(900)]).shortfall == told


@given(st.lists(st.integers(0, 20), min_size=1, max_size=400))
def test_percentiles_agree_with_numpy(ages):
    monitor = DelayMonitor()
    for k, age in enumerate(ages):
        monitor.add(k * DT_US, age)
    for share in (0.5, 0.95):
        assert monitor.percentile(share) == int(np.percentile(ages, 100 * share, method="inverted_cdf"))


def test_only_the_last_two_seconds_count():
    monitor, rate = DelayMonitor(), RateMonitor()
    for k in range(1500):
        monitor.add(k * DT_US, 9 if k < 900 else 1)
        rate.add(k * DT_US)
    assert monitor.percentile(0.99) == 1
    assert rate.hz == pytest.approx(250.0)


def test_monitors_without_samples_say_so():
    assert DelayMonitor().percentile(0.5) == UNKNOWN_AGE
    assert RateMonitor().hz == 0.0
    assert not RateMonitor().full


def test_hysteresis_needs_unbroken_evidence_both_ways():
    gate = Hysteresis(rise_us=100, fall_us=50)
    assert not gate.update(0, True)
    assert not gate.update(99, True)
    assert not gate.update(100, False)
    assert not gate.update(110, True)
    assert gate.update(210, True)
    assert gate.update(220, False)
    assert gate.update(269, False)
    assert not gate.update(270, False)


def test_a_round_trip_counts_once_and_only_for_what_was_asked():
    trip = RoundTrip()
    trip.asked(5_000_000_000)
    assert trip.answered(4_999_999_999, 5.02) is None
    assert trip.answered(5_000_000_000, 5.02) == pytest.approx(0.02)
    assert trip.answered(5_000_000_000, 9.0) is None  # a copy, on a slower link
    assert trip.percentile(0.5) == pytest.approx(0.02)


def test_round_trips_are_forgotten_when_they_are_old():
    trip = RoundTrip()
    for second in range(8):
        trip.asked(second * 10**9)
        trip.answered(second * 10**9, second + (0.1 if second < 4 else 0.004))
    assert trip.percentile(1.0) == pytest.approx(0.1)
    trip.forget(9.0)
    assert trip.percentile(1.0) == pytest.approx(0.004)
    trip.forget(13.0)
    assert np.isnan(trip.delay_samples(0.004))

"""Irregular, missing, late and jumping stamps, brought to the design's grid (dob_companion/companion/samples.py)."""

from itertools import pairwise
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from dob_companion.companion.samples import Arrival, Samples
from dob_companion.observer import Missing
from tests.effort import examples

DT_US = 4000


def rate_at(t_us):
    """A smooth three-axis motion, rad/s: 1 to 7 Hz."""
    t = t_us * 1e-6
    return np.array([np.sin(2 * np.pi * 1.0 * t), 0.3 * np.cos(2 * np.pi * 3.0 * t), 0.1 * np.sin(2 * np.pi * 7.0 * t)])


class Lines:
    """Missing samples on the line between those around them; without moments the gyro stands still."""

    def bridge(self, first, moments, last, beyond):
        steps = len(moments) + beyond
        return [tuple(np.asarray(first) + (k + 1) / steps * np.subtract(last, first)) for k in range(len(moments))]

    def expect(self, _finished, _moment):
        return 0.0, 0.0, 0.0


class Told(Samples):
    """Takes arrays for three values."""

    def gyro(self, stamp_us, rates):
        return super().gyro(stamp_us, tuple(map(float, rates)))

    def moment(self, stamp_us, moment):
        return super().moment(stamp_us, tuple(map(float, moment)))


def new_samples(samples=1, moments=1):
    return Told(DT_US * 1e-6, Missing(samples, moments), Lines())


def fed(stamps, moment_offset=0, moments=None):
    """All finished inputs, in order, of gyro samples and moments at the stamps."""
    samples, finished = new_samples(), []
    for k, stamp in enumerate(stamps):
        finished += samples.gyro(int(stamp), rate_at(stamp)).finished
        value = np.full(3, float(k)) if moments is None else moments(stamp + moment_offset)
        samples.moment(int(stamp) + moment_offset, value)
    return samples, finished


def test_a_regular_stream_is_taken_exactly_as_it_is():
    stamps = 1_000_000 + DT_US * np.arange(500)
    samples, finished = fed(stamps)
    assert len(finished) == 499
    for k, inputs in enumerate(finished):
        assert np.array_equal(inputs[0], rate_at(stamps[k]))
        assert np.array_equal(inputs[1], np.full(3, float(k)))
    assert (samples.counters.bridged, samples.counters.gaps, samples.counters.late) == (0, 0, 0)


def test_a_clock_that_drifts_by_half_a_percent_is_followed_without_interpolating():
    stamps = np.round(4020 * np.arange(2000)).astype(int)
    _, finished = fed(stamps)
    assert len(finished) == 1999
    assert all(np.array_equal(inputs[0], rate_at(stamps[k])) for k, inputs in enumerate(finished))


@pytest.mark.parametrize("steps", [(2500, 5000), (2500, 2500, 5000), (5000, 3000), (3500, 4700)])
def test_alternating_stamps_give_the_designs_rate_and_the_line_between_samples(steps):
    stamps = np.cumsum([steps[k % len(steps)] for k in range(3000)])
    _, finished = fed(stamps, moments=lambda _t: np.full(3, 0.25))
    assert len(finished) == pytest.approx((stamps[-1] - stamps[0]) / DT_US, abs=40 * 0.02 * len(stamps))
    assert all(np.array_equal(inputs[1], np.full(3, 0.25)) for inputs in finished)


def test_the_error_of_interpolation_is_of_second_order():
    def worst(step):
        samples, errors = new_samples(), []
        t = 0
        for k in range(2000):
            t += step if k % 2 else 5000 if step == 2500 else 8000 - step
            arrived = samples.gyro(t, rate_at(t))
            samples.moment(t, np.zeros(3))
            errors.append(np.abs(arrived.rates - rate_at(samples._grid)))
        return np.max(errors, axis=0)

    bound = np.array([1.0 * (2 * np.pi) ** 2, 0.3 * (6 * np.pi) ** 2, 0.1 * (14 * np.pi) ** 2]) * 0.005**2 / 8
    assert np.all(worst(2500) <= bound * 1.01)


@pytest.mark.parametrize("offset", [500, 1000, 2000, 3000])
def test_a_moment_between_gyro_stamps_acts_from_its_own_stamp_on(offset):
    stamps = DT_US * np.arange(400)
    samples, finished = fed(stamps, moment_offset=offset)
    assert len(finished) == 398  # nothing acts at the first sample
    for k, inputs in enumerate(finished, start=1):
        expected = ((k - 1) * offset + k * (DT_US - offset)) / DT_US
        assert inputs[1][0] == pytest.approx(expected, abs=1e-9)
    assert samples.counters.late == 0


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(st.integers(1500, 5900), min_size=50, max_size=200), st.integers(0, 2**32 - 1))
def test_the_integral_of_the_moment_is_kept_on_any_stamps(steps, seed):
    stamps = np.cumsum(steps)
    values = np.random.default_rng(seed).normal(size=len(stamps))
    samples, finished = new_samples(), []
    for stamp, value in zip(stamps, values, strict=True):
        finished += samples.gyro(int(stamp), np.zeros(3)).finished
        samples.moment(int(stamp), np.full(3, value))
    assert samples.counters.gaps == 0
    total = sum(inputs[1][0] for inputs in finished) * DT_US
    covered = samples._grid - stamps[0]
    exact, begin = 0.0, stamps[0]
    for k, value in enumerate(values):
        end = min(stamps[k + 1] if k + 1 < len(stamps) else begin, samples._grid)
        exact += value * max(0.0, end - stamps[k])
    assert total == pytest.approx(exact, abs=0.02 * DT_US * 3 * len(stamps))
    assert covered == pytest.approx(len(finished) * DT_US, abs=0.02 * DT_US * len(finished) + 1)


def test_two_missing_samples_in_a_row_are_a_gap():
    samples, _ = fed(DT_US * np.arange(10))
    assert samples.gyro(DT_US * 12, np.zeros(3)).arrival is Arrival.GAP
    assert samples.counters.gaps == 1


def test_every_second_sample_missing_is_not_bridged_for_ever():
    samples = new_samples()
    kinds = []
    for k in range(0, 20, 2):
        kinds.append(samples.gyro(DT_US * k, np.zeros(3)).arrival)
        samples.moment(DT_US * k, np.zeros(3))
    assert kinds[1] is Arrival.NEXT
    assert Arrival.GAP in kinds[2:4]


def test_two_missing_moments_in_a_row_are_a_gap():
    samples, _ = fed(DT_US * np.arange(10))
    kinds = [samples.gyro(DT_US * k, np.zeros(3)).arrival for k in range(10, 14)]
    assert kinds[:2] == [Arrival.NEXT, Arrival.NEXT]
    assert Arrival.GAP in kinds[2:]


def test_a_moment_that_comes_before_its_gyro_sample_is_kept_for_it():
    samples, _ = fed(DT_US * np.arange(10))
    samples.moment(DT_US * 10, np.full(3, 7.0))
    samples.gyro(DT_US * 10, np.zeros(3))
    (inputs,) = samples.gyro(DT_US * 11, np.zeros(3)).finished
    assert np.array_equal(inputs[1], np.full(3, 7.0))


def totals(arrivals):
    """What each interval has been told in the end, and the stamps of moments that were of no use.

    `arrivals`: (stamp, moment), the moment None for a gyro sample."""
    samples, told, dropped = new_samples(moments=8), [], set()
    for stamp, moment in arrivals:
        if moment is None:
            told += [np.array(inputs) for inputs in Samples.gyro(samples, stamp, tuple(rate_at(stamp))).finished]
            continue
        revised = Samples.moment(samples, stamp, (moment, 0.0, 0.0))
        if revised is None:
            dropped.add(stamp)
        for ago, rates, changed in revised or ():
            told[len(told) - 1 - ago] += np.array((rates, changed))
    assert samples.counters.gaps <= 1
    return np.array(told), dropped


@settings(max_examples=examples(200), deadline=None)
@given(
    st.lists(st.sampled_from([-1.6, 0.3, 0.5, 0.5, 0.5, 1.4, 2.5, None]), min_size=20, max_size=60),
    st.integers(0, 2**32 - 1),
)
def test_in_which_order_moments_and_samples_come_leaves_no_trace(delays, seed):
    """Each moment comes so many samples after its own gyro sample, or never; at the end all come in time."""
    delays = [0.5] * 3 + delays + [0.5] * 16
    values = np.random.default_rng(seed).normal(size=len(delays)).tolist()
    gyro = [(float(k), DT_US * k, None) for k in range(len(delays))]
    came = [(k + delay, DT_US * k, values[k]) for k, delay in enumerate(delays) if delay is not None]
    assume(max(b - a for a, b in pairwise(sorted(stamp for _, stamp, _ in came))) <= 4 * DT_US)
    found, dropped = totals([arrival[1:] for arrival in sorted(gyro + came, key=itemgetter(0))])
    in_time = [(stamp / DT_US + 0.5, stamp, moment) for _, stamp, moment in came if stamp not in dropped]
    expected, _ = totals([arrival[1:] for arrival in sorted(gyro + in_time, key=itemgetter(0))])
    assert found == pytest.approx(expected, abs=1e-12)


def test_a_moment_that_comes_behind_one_ahead_of_it_ends_the_line_to_that_one():
    begin = [*((int(t), m) for t in DT_US * np.arange(3) for m in (None, 0.0)), (12000, None)]
    told, _ = totals([*begin, (20000, 6.0), (12000, 3.0), (16000, 0.0), (16000, None)])
    assert told[:, 1, 0] == pytest.approx([0.0, 0.0, 0.0, 3.0])


def test_a_moment_ahead_of_its_sample_makes_the_line_of_the_interval_before():
    stamps = DT_US * np.arange(6)
    told, _ = totals(
        [*((int(t), m) for t in stamps[:3] for m in (None, 0.0)), (12000, None), (20000, 6.0), (16000, None)]
    )
    assert told[:, 1, 0] == pytest.approx([0.0, 0.0, 1.0, 3.0])


def test_a_moment_older_than_one_that_finished_intervals_know_is_dropped_and_counted():
    samples, _ = fed(DT_US * np.arange(10))
    assert samples.moment(DT_US * 5, (1.0, 1.0, 1.0)) is None
    assert samples.counters.late == 1


def test_a_clock_that_jumps_back_starts_anew():
    samples, _ = fed(10_000_000 + DT_US * np.arange(10))
    assert samples.gyro(1_000, np.zeros(3)).arrival is Arrival.RESTART
    assert samples.gyro(1_000 + DT_US, np.zeros(3)).arrival is Arrival.GAP
    samples.moment(1_000 + DT_US, np.zeros(3))
    assert samples.gyro(1_000 + 2 * DT_US, np.zeros(3)).arrival is Arrival.NEXT


def test_moments_between_the_gyro_s_stamps_are_taken_again_after_the_clock_has_jumped_back():
    samples, _ = fed(10_000_000 + DT_US * np.arange(10), moment_offset=500)
    stamps = 1_000 + DT_US * np.arange(10)
    finished = []
    for k, stamp in enumerate(stamps):
        finished += samples.gyro(int(stamp), np.zeros(3)).finished
        if k:
            samples.moment(int(stamp) - 500, np.full(3, 7.0))
    assert samples.counters.late == 0
    assert finished[-1][1] == (7.0, 7.0, 7.0)


# Bounds and clocks ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [4000, 100, 1, -4000])
def test_moments_do_not_pile_up_when_the_gyro_stops(step):
    samples, _ = fed(DT_US * np.arange(10))
    for k in range(20_000):
        samples.moment(DT_US * 10 + step * k, np.zeros(3))
    assert len(samples._moments) <= 64


def test_moments_do_not_pile_up_before_the_first_gyro_sample_nor_on_another_clock():
    for shift in (-5_000_000, 100_000, 5_000_000):
        samples = new_samples()
        for k in range(2000):
            if k > 200:
                samples.gyro(10_000_000 + DT_US * k, np.zeros(3))
            samples.moment(10_000_000 + DT_US * k + shift, np.zeros(3))
        assert len(samples._moments) <= 64


def test_the_moments_of_a_hole_in_the_gyro_are_there_when_it_ends():
    samples, _ = fed(DT_US * np.arange(10))
    for k in range(10, 15):
        samples.moment(DT_US * k, np.full(3, float(k)))
    assert samples.gyro(DT_US * 14, np.zeros(3)).arrival is Arrival.GAP
    (inputs,) = samples.gyro(DT_US * 15, np.zeros(3)).finished
    assert np.array_equal(inputs[1], np.full(3, 14.0))


@pytest.mark.parametrize(("shift", "offset"), [(5_000_000, 5.0), (-5_000_000, -5.0), (100_000, 0.1), (-100_000, -0.1)])
def test_two_clocks_are_recognized_named_and_forgotten_when_they_are_one(shift, offset):
    samples = new_samples()
    for k in range(400):
        samples.gyro(10_000_000 + DT_US * k, np.zeros(3))
        samples.moment(10_000_000 + DT_US * k + (shift if k < 300 else 0), np.zeros(3))
        if k == 299:
            assert samples.clocks.offset_s == pytest.approx(offset)
            assert f"another clock than the gyro: {'+' if shift > 0 else '-'}" in samples.clocks.why
    assert samples.clocks.why == ""


@pytest.mark.parametrize("stopped", ["gyro", "moment"])
def test_a_stream_that_stops_or_comes_in_bursts_is_not_another_clock(stopped):
    samples = new_samples()
    for k in range(2000):
        if stopped != "gyro" or k < 100:
            samples.gyro(DT_US * k, np.zeros(3))
        if stopped != "moment" or k < 100:
            samples.moment(DT_US * k, np.zeros(3))
    for k in range(2000, 2400, 20):
        for j in range(20):
            samples.gyro(DT_US * (k + j), np.zeros(3))
        for j in range(20):
            samples.moment(DT_US * (k + j), np.zeros(3))
    assert samples.clocks.why == ""


def controller_at(t_us):
    """What a controller puts out, on a line for a second: torque."""
    return tuple(1e-7 * t_us * np.array([1.0, -2.0, 0.5]))


def test_a_moment_that_was_read_lies_on_the_line_between_two_readings_and_our_part_acts_later():
    """Readings 5 and 7 ms apart, gyro samples each 4 ms: each finished interval ends up with its true mean."""
    samples, ours, late = new_samples(9, 9), (0.01, 0.0, -0.02), 1250
    samples.gyro(0, np.zeros(3))
    finished = {}
    readings = np.cumsum([0, *[5000, 7000] * 20])
    stamp = 0
    for reading in readings:
        while stamp + DT_US <= reading:
            stamp += DT_US
            for inputs in samples.gyro(stamp, np.zeros(3)).finished:
                finished[len(finished)] = np.array(inputs[1])
        began = ours if reading >= 30_000 else (0.0, 0.0, 0.0)
        whole = np.add(controller_at(reading), began)
        revised = Samples.moment(samples, int(reading), tuple(whole.tolist()), began, late)
        for ago, _, change in revised or ():
            finished[len(finished) - 1 - ago] += change
    begins = DT_US * np.arange(len(finished))
    first = next(int(reading) for reading in readings if reading >= 30_000) + late
    for k, begin in enumerate(begins[: first // DT_US - 1]):
        assert finished[k] == pytest.approx(controller_at(begin + DT_US / 2), abs=1e-9)
    share = (begins[first // DT_US] + DT_US - first) / DT_US
    assert finished[first // DT_US] == pytest.approx(
        np.add(controller_at(begins[first // DT_US] + DT_US / 2), share * np.array(ours)), abs=1e-9
    )
    for k in range(first // DT_US + 1, len(finished) - 3):
        assert finished[k] == pytest.approx(np.add(controller_at(begins[k] + DT_US / 2), ours), abs=1e-9)

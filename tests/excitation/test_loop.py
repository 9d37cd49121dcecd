"""When it begins, what it adds, and what ends it, in simulated time."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dob_companion.companion import CompanionConfig
from dob_companion.companion.dob import DobLoop
from dob_companion.companion.loop import Loop
from dob_companion.excitation.delays import BY_AGE, BY_ROUND_TRIP
from dob_companion.excitation.limits import Limits, Probe
from dob_companion.excitation.loop import REST_S, TAIL_S, ExcitationLoop
from dob_companion.excitation.signal import CHIRP, Excitation, table
from dob_companion.mavlink import Landed
from dob_companion.supervisor import State
from tests.excitation.hover import DT, LONG, SHORT, degrees, flown, hover

AT_ONCE, GENTLY, ZERO = 25, 125, 0
"""Samples after which the moment is zero: 0.1 s, DOB_RAMP_S, at once."""


def test_it_answers_every_sample_with_exact_zero_until_all_has_been_well_for_a_while():
    plane = hover(landed=Landed.ON_GROUND)
    assert not any(plane.fly(800))
    assert plane.loop.why == "on the ground"
    plane.landed = Landed.IN_AIR
    plane.until(State.RAMP_IN)
    begun = plane.loop.passages[0].begin_us
    waited = [answer for answer in plane.sent if any(answer)]
    assert len(waited) <= 1
    assert begun >= 10_000_000 + 800 * 4000 + 1e6 * REST_S


def test_the_axes_come_one_after_another_with_rests_and_each_alone():
    plane = hover(amplitudes={"roll": 0.05, "yaw": 0.1}).to_the_end()
    assert plane.loop.outcome == "complete"
    roll, yaw = plane.loop.passages
    assert (roll.axis, yaw.axis, roll.complete, yaw.complete) == ("roll", "yaw", True, True)
    assert yaw.begin_us - roll.end_us >= 1e6 * REST_S
    sent = np.array(plane.sent)
    assert not sent[:, 1].any()
    assert not (sent[:, 0].astype(bool) & sent[:, 2].astype(bool)).any()
    assert np.abs(sent[:, 0]).max() <= 0.05 < np.abs(sent[:, 2]).max() <= 0.1
    tail = plane.sent[-round(TAIL_S / DT) :]
    assert all(answer == (0.0, 0.0, 0.0) for answer in tail)


def test_how_late_what_was_sent_acted_is_measured_while_an_axis_is_excited():
    plane = hover(age=7.0).until(State.RAMP_IN)
    assert plane.loop.delays.late is None
    for k in range(1000):
        plane.age = 3.0 if k % 10 == 0 else 2.0
        plane.fly()
    delays = plane.loop.delays
    assert (delays.median, delays.late, delays.source) == (2, 3, BY_AGE)


def test_where_the_vehicle_does_not_tell_it_the_round_trip_stands_for_the_delay():
    plane = hover(age=math.nan)
    for _ in range(3000):
        plane.loop.time_asked(round(1e9 * plane.now), plane.now)
        plane.loop.time_answered(round(1e9 * plane.now), plane.now + 2.5 * DT)
        plane.fly()
    delays = plane.loop.delays
    assert (delays.median, delays.late, delays.source) == (3, 3, BY_ROUND_TRIP)


def test_what_is_added_is_the_signal_at_the_stamps_of_the_vehicle_also_across_missing_samples():
    plane = hover().until(State.ACTIVE)
    values = table(SHORT, 0.05, DT, 1)
    begun = (plane.loop.passages[0].begin_us - 10_000_000) // 4000
    for _ in range(10):
        at = plane.sample - begun
        assert plane.fly() == [pytest.approx(values[at], abs=1e-12)]
        plane.fly(2)
        plane.sample += 2  # two that nobody hears of
        plane.now += 2 * DT
    assert plane.loop.outcome == ""


def test_an_aircraft_that_moves_much_gets_less_than_the_whole_amplitude():
    plane = hover(limits=Limits(rate=1.0))
    plane.until(State.RAMP_IN)
    plane.rates = (0.0, 0.3, 0.0)  # at 0.3 of the amplitude: the whole would make 1.0
    plane.to_the_end()
    assert plane.loop.passages[0].level == pytest.approx(0.6)
    assert np.abs(np.array(plane.sent)).max() <= 0.6 * 0.05 + 1e-12


def test_a_still_aircraft_gets_the_whole():
    probe, f = Probe(1.0), 0.0
    for sample in range(1000):
        f = min(f + 0.008, probe.target(sample * DT, f, 0.01))
    assert (f, probe.level) == (1.0, 1.0)


def fell(plane, samples):
    """It fades from what was sent last and stays zero, with nothing ever rising where it fades at once."""
    last = abs(plane.sent[-1][1])
    after = np.abs([answer[1] for answer in plane.sent[-1:]] + plane.fly(samples + 2))
    if samples == AT_ONCE:
        assert np.all(np.diff(after) <= 1e-15)
    if samples == ZERO:
        assert not after[1:].any()
    else:
        assert after[1:].max() <= 0.05
        assert last > 0.0
    assert after[-1] == 0.0
    assert not any(plane.fly(300))


BREAKS = {
    "body rate": ({"rates": (0.0, 0.0, 2.0)}, "body rate 1.60 rad/s beyond 1.5", 2 + AT_ONCE),
    "tilt": ({"tilt": degrees(40)}, "tilt 40 deg beyond 25", AT_ONCE),
    "climbs": ({"altitude": 13.0}, "altitude changed by +3.0 m", GENTLY),
    "sinks": ({"altitude": 7.0}, "altitude changed by -3.0 m", GENTLY),
    "battery": ({"charge": 0.15}, "battery 15 % below 20 %", GENTLY),
    "kill switch": ({"pulse": 1900}, "killed by RC channel 7", AT_ONCE),
    "disarmed": ({"armed": False}, "not armed", AT_ONCE),
    "landed": ({"landed": Landed.ON_GROUND}, "on the ground", AT_ONCE),
    "landing": ({"landed": Landed.LANDING}, "taking off or landing", AT_ONCE),
    "forward flight": ({"forward": True}, "not in multicopter mode", AT_ONCE),
    "mode": ({"mode": 5}, "flight mode changed", AT_ONCE),
    "failsafe": ({"failsafe": True}, "autopilot reports a failsafe", AT_ONCE),
    "throttle": ({"thrust": 0.0}, "throttle below 0.05", AT_ONCE),
    "gyro not finite": ({"rates": (0.0, math.nan, 0.0)}, "gyro rate not finite", ZERO),
    "moment not finite": ({"moment": (0.0, math.inf, 0.0)}, "applied moment not finite", ZERO),
    "foreign": ({"contained": (0.0, 0.04, 0.3)}, "corrections come back changed", AT_ONCE),
    "no altitude": ({"altitude": None}, "altitude no longer told", AT_ONCE),
    "no attitude": ({"tilt": None}, "attitude no longer told", AT_ONCE),
}


@pytest.mark.parametrize("broken", BREAKS)
def test_whatever_is_not_well_ends_it_for_good_with_the_reason(broken):
    change, reason, samples = BREAKS[broken]
    plane = flown()
    for name, value in change.items():
        setattr(plane, name, value)
    for _ in range(900):  # what is told at 10 Hz is told by then, and what is not counts no more
        if plane.loop.outcome:
            break
        plane.fly()
    assert plane.loop.outcome == f"aborted: {reason}"
    if samples == 2 + AT_ONCE:
        samples = AT_ONCE
    fell(plane, samples)
    assert plane.loop.over
    assert not plane.loop.passages[0].complete
    for name in change:  # and when all is well again, nothing begins again
        setattr(plane, name, getattr(hover(), name))
    assert not any(plane.fly(900))


def test_an_off_of_a_ground_station_ends_it_gently():
    plane = flown()
    plane.write("DOB_ENABLE", 0.0)
    fell(plane, GENTLY)
    assert plane.loop.outcome == "aborted: switched off"
    plane.write("DOB_ENABLE", 1.0)
    assert not any(plane.fly(1500))


def test_a_gap_ends_it_within_a_tenth_of_a_second_and_nothing_rises():
    plane = flown()
    plane.sample += 8
    plane.now += 8 * DT
    plane.fly()
    assert plane.loop.outcome == "aborted: gap in samples"
    fell(plane, AT_ONCE)


def test_when_the_vehicle_may_have_timed_out_only_zeros_follow():
    plane = flown()
    plane.sample += 30
    plane.now += 30 * DT
    assert not any(plane.fly(500))
    assert "gap in samples" in plane.loop.outcome


def test_a_vehicle_that_names_the_same_answer_for_long_is_without_news_and_gets_zeros():
    plane = flown()
    for age in range(2, 40):
        plane.age = float(age)
        plane.fly()
    assert plane.loop.outcome == "aborted: corrections do not reach the vehicle"
    assert not any(plane.fly(500))


def test_silence_ends_it():
    plane = flown()
    plane.loop.silent()
    assert plane.loop.outcome == "aborted: no samples"
    assert not plane.loop.injecting
    assert plane.loop.over
    assert not any(plane.fly(1000))


def test_a_clock_that_jumps_back_ends_it_with_zero():
    plane = flown()
    plane.sample -= 1000
    assert not any(plane.fly(1500))
    assert plane.loop.outcome == "aborted: vehicle clock jumped back"


def test_another_controller_that_is_heard_ends_it():
    plane = flown()
    plane.loop.stranger(1, 191, plane.now)
    fell(plane, AT_ONCE)
    assert plane.loop.outcome == "aborted: another controller on the link: 1/191"


def test_a_correction_that_acts_before_it_has_begun_is_somebody_elses_and_ends_it():
    plane = hover()
    plane.fly(100)
    plane.contained = (0.02, 0.0, 0.0)
    assert not any(plane.fly(1500))
    assert plane.loop.outcome == "aborted: corrections come back changed"


def test_a_grave_reason_during_a_gentle_end_makes_it_sudden():
    plane = flown()
    plane.write("DOB_ENABLE", 0.0)
    plane.fly(10)
    plane.pulse = 2000
    plane.fly(25)  # told at 10 Hz
    assert not any(plane.fly(60)[26:])
    assert plane.loop.outcome == "aborted: switched off"


def test_before_it_has_begun_a_limit_is_waited_for():
    plane = hover(tilt=degrees(30))
    assert not any(plane.fly(1500))
    assert plane.loop.why == "tilt 30 deg beyond 25"
    plane.tilt = 0.0
    assert plane.to_the_end().loop.outcome == "complete"


def test_in_the_rest_between_two_axes_it_ends_as_well():
    plane = hover(amplitudes={"roll": 0.05, "pitch": 0.05}).until(State.RAMP_OUT).until(State.TRACKING)
    plane.mode = 6
    plane.to_the_end()
    assert plane.loop.outcome == "aborted: flight mode changed"
    assert [passage.axis for passage in plane.loop.passages] == ["roll"]


def test_a_vehicle_that_tells_no_altitude_is_not_waited_for_beyond_its_time():
    plane = hover(altitude=None, charge=None)
    assert plane.to_the_end().loop.outcome == "complete"
    assert plane.loop.guard.unheard == ["altitude", "battery"]


def test_a_repeated_sample_is_answered_as_before_and_a_late_one_not_at_all():
    plane = flown()
    plane.sample -= 1
    newest = plane.loop.gyro(sample_of(plane), plane.now)
    assert newest is plane.loop.answer
    assert newest.correction == plane.sent[-1]
    plane.sample -= 1
    assert plane.loop.gyro(sample_of(plane), plane.now) is None


def test_parameters_act_as_on_a_correction():
    plane = flown()
    plane.write("DOB_LIMIT", 0.01)
    plane.fly(150)
    assert np.abs(plane.fly(100)).max() == pytest.approx(0.01)
    plane.write("DOB_AXES", 1.0)
    plane.fly(150)
    assert not any(plane.fly(50))
    assert plane.loop.outcome == ""


def test_a_chirp_ends_as_well():
    plane = hover(signal=Excitation(kind=CHIRP, seconds=4.0, low_hz=0.5)).to_the_end()
    assert plane.loop.outcome == "complete"


def test_it_has_every_verb_that_a_companion_uses():
    verbs = {name for name in vars(Loop) if not name.startswith("_")}
    assert len(verbs) > 20
    for kind in (ExcitationLoop, DobLoop):
        assert verbs - set(dir(kind)) <= {"dt", "closing"}
    assert dataclasses.is_dataclass(CompanionConfig)


def sample_of(plane):
    from dob_companion.mavlink import GyroSample

    return GyroSample(plane.stamp, plane.rates)


EVENTS = st.lists(
    st.tuples(
        st.integers(1, 500),
        st.sampled_from(["lose 1", "lose 4", "lose 9", "lose 40", "cut", "rate", "off", "kill", "mode", "ramp"]),
    ),
    max_size=4,
)


@given(events=EVENTS)
@settings(max_examples=10, deadline=None)
def test_whatever_happens_no_step_exceeds_fade_and_signal_nothing_follows_the_end_and_nothing_rises_after_a_cut(events):
    plane = flown(State.RAMP_IN)
    slew = np.abs(np.diff(table(LONG, 0.05, DT, 1))).max()
    before = plane.sample - 1
    for pause, event in [*events, (700, "still")]:
        for _ in range(pause):
            at, ended = plane.sample, plane.loop.outcome
            last = plane.sent[-1][1]
            (now,) = plane.fly()
            passed = at - before
            before = at
            if now != 0.0:
                assert abs(now - last) <= passed * (slew + 0.05 * DT / 0.1) + 1e-12
                assert abs(now) <= 0.05
            if plane.loop._at_once and ended:
                assert abs(now) <= abs(last)
                assert now * last >= 0.0
        happen(plane, event)
    plane.to_the_end()
    assert not any(plane.fly(300))


def happen(plane, event):
    kind, _, number = event.partition(" ")
    match kind:
        case "lose":
            plane.sample += int(number)
            plane.now += int(number) * DT
        case "cut":
            plane.age = 60.0
        case "rate":
            plane.rates = (2.0, 0.0, 0.0)
        case "off":
            plane.write("DOB_ENABLE", 0.0)
        case "kill":
            plane.pulse = 2000
        case "mode":
            plane.mode += 1
        case "ramp":
            plane.write("DOB_RAMP_S", 0.2)

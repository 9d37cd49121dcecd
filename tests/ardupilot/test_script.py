"""deploy/ardupilot/dob_correction.lua, in a real Lua around which ArduPilot's bindings are played."""

import math

import numpy as np
import pytest

from tests.ardupilot.autopilot import PLANE, Autopilot

MOMENT = (0.05, -0.08, 0.03)


def ready(**changes) -> Autopilot:
    """An autopilot whose companion has been heard for a second, with all limits in force."""
    autopilot = Autopilot(moment=MOMENT, **changes)
    autopilot.run(1.6)
    autopilot.converse(1.0, 0.0)
    return autopilot


def close(a, b, tolerance=1e-6):
    return np.allclose(a, b, rtol=0.0, atol=tolerance)


# The mixer ------------------------------------------------------------------------------------------------------------


def test_quad_x_has_the_factors_that_ardupilot_documents():
    # x-quad-cg-allocation and Motor_mixer_dynamic_setup of ArduPilot's own scripts
    factors = Autopilot().factors
    assert close(list(factors["roll"].values()), [-0.5, 0.5, 0.5, -0.5])
    assert close(list(factors["pitch"].values()), [0.5, -0.5, 0.5, -0.5])
    assert close(list(factors["yaw"].values()), [0.5, 0.5, -0.5, -0.5])


def test_quad_plus_has_the_factors_that_ardupilot_documents():
    factors = Autopilot({"FRAME_TYPE": 0}).factors
    assert close(list(factors["roll"].values()), [-0.5, 0.5, 0.0, 0.0])
    assert close(list(factors["pitch"].values()), [0.0, 0.0, 0.5, -0.5])
    assert close(list(factors["yaw"].values()), [0.5, 0.5, -0.5, -0.5])


FRAMES = [(1, 0), (1, 1), (1, 3), (2, 0), (2, 1), (3, 0), (3, 1)]


@pytest.mark.parametrize(("frame", "kind"), FRAMES)
def test_every_frame_is_balanced_and_its_axes_do_not_mix(frame, kind):
    autopilot = Autopilot({"DOBC_FRAME": frame, "FRAME_TYPE": kind})
    rows = [np.array(list(autopilot.factors[axis].values())) for axis in ("roll", "pitch", "yaw")]
    assert len(rows[0]) == {1: 4, 2: 6, 3: 8}[frame]
    assert sorted(autopilot.test_order.values()) == list(range(1, len(rows[0]) + 1))
    for i, row in enumerate(rows):
        assert close(row.sum(), 0.0)
        assert np.max(np.abs(row)) == pytest.approx(0.5)
        for other in rows[:i]:
            assert close(row @ other, 0.0)


@pytest.mark.parametrize(("frame", "kind"), FRAMES)
def test_a_correction_is_added_to_every_axis_exactly(frame, kind):
    autopilot = ready(parameters={"DOBC_FRAME": frame, "FRAME_TYPE": kind})
    autopilot.converse(0.1, 0.04, -0.03, 0.02)
    assert close(autopilot.added(), (0.04, -0.03, 0.02))
    assert autopilot.thrusts().mean() == pytest.approx(autopilot.throttle)


def test_without_a_correction_the_mixer_is_the_stock_one():
    autopilot = ready()
    assert set(autopilot.factors["throttle"].values()) == {1.0}


def test_an_unknown_airframe_is_refused():
    autopilot = Autopilot({"DOBC_FRAME": 7})
    autopilot.run(0.1)
    assert autopilot.motors == 0
    assert autopilot.refusal == "DOBC: DOBC_FRAME 7 type 1 not known"


def test_the_airframe_may_be_told_later_but_not_changed_without_a_reboot():
    autopilot = Autopilot({"DOBC_FRAME": 0})
    autopilot.run(0.1)
    autopilot.parameters["DOBC_FRAME"] = 2
    autopilot.run(0.6)
    assert (autopilot.motors, autopilot.refusal) == (6, None)
    autopilot.parameters["DOBC_FRAME"] = 1
    autopilot.run(0.6)
    assert (autopilot.motors, autopilot.refusal) == (6, "DOBC: frame changed, reboot")


def test_with_the_stock_frame_class_the_script_stands_aside():
    autopilot = Autopilot({"FRAME_CLASS": 1, "DOBC_ENABLE": 0})
    autopilot.run(0.1)
    assert autopilot.refusal is None
    assert autopilot.motors == 0


def test_enabled_without_its_mixer_it_refuses_arming():
    autopilot = Autopilot({"FRAME_CLASS": 1})
    autopilot.run(0.1)
    assert autopilot.refusal == "DOBC: FRAME_CLASS is not 17"


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("DOBC_LIMIT", 0.6, "DOBC_LIMIT not in 0..0.5"),
        ("DOBC_LIMIT_Y", math.nan, "DOBC_LIMIT_Y not in 0..0.5"),
        ("DOBC_RC_FN", 41, "DOBC_RC_FN not 0 or 300..315"),
        ("DOBC_RATE", 0, "DOBC_RATE not in 10..1000"),
        ("FRAME_TYPE", 0, "frame changed, reboot"),
    ],
)
def test_a_wrong_parameter_refuses_arming_and_lets_nothing_in(name, value, why):
    autopilot = ready()
    autopilot.parameters[name] = value
    autopilot.converse(1.0, 0.05)
    assert autopilot.refusal == f"DOBC: {why}"
    assert close(autopilot.added(), 0.0)


# What is told ---------------------------------------------------------------------------------------------------------


def test_the_answer_says_what_acts_from_when_and_how_old_it_is():
    autopilot = ready()
    autopilot.converse(0.1, 0.04, -0.03, 0.02)
    answer = autopilot.answers[-1]
    assert close(answer.moment, np.add(MOMENT, (0.04, -0.03, 0.02)))
    assert close(answer.correction, (0.04, -0.03, 0.02))
    assert answer.thrust == pytest.approx(0.4)
    assert answer.stamp_us == autopilot.now_us
    assert answer.age == pytest.approx(2.0)  # sent one sample late, taken up one after


def test_stamp_and_age_lead_back_to_the_sample_that_was_answered():
    autopilot = ready()
    stamp_us = autopilot.hear(0.01, age_us=3217)
    autopilot.run(0.003, step_us=3000)
    answer = autopilot.answers[-1]
    assert answer.stamp_us - round(answer.age * 4000) == stamp_us


def test_two_answers_never_have_one_stamp():
    autopilot = ready()
    for _ in range(3):
        stamp_us = autopilot.hear(0.01, age_us=4000)
        autopilot.run(0.004)
        first = autopilot.answers[-1]
        newer_us = autopilot.hear(0.02, stamp_us=stamp_us + 500)
        autopilot.run(0.0, step_us=0)
        second = autopilot.answers[-1]
        assert second.stamp_us == first.stamp_us + 1
        assert second.stamp_us - round(second.age * 4000) == newer_us
        assert second.correction[0] == pytest.approx(0.02)


def test_age_is_counted_in_samples_of_the_rate_that_is_set():
    autopilot = ready(parameters={"DOBC_RATE": 125})
    autopilot.converse(0.1, 0.0)
    assert autopilot.answers[-1].age == pytest.approx(1.0)


def test_a_correction_gets_one_answer_and_silence_no_more_than_the_rate():
    autopilot = ready()
    before = len(autopilot.answers)
    autopilot.run(0.1, step_us=1000)
    assert 24 <= len(autopilot.answers) - before <= 26


def test_a_companion_that_has_gone_gets_age_minus_one_and_then_no_answers():
    autopilot = ready()
    autopilot.run(0.3)
    assert autopilot.answers[-1].age == -1.0
    autopilot.run(6.0)
    before = len(autopilot.answers)
    autopilot.run(1.0)
    assert len(autopilot.answers) == before


def test_a_companion_that_only_listens_is_told_what_acts_and_nothing_is_added():
    autopilot = Autopilot(moment=MOMENT)
    for _ in range(3):
        autopilot.greet()
        autopilot.run(1.0)
    assert 249 <= sum(answer.stamp_us > autopilot.now_us - 1_000_000 for answer in autopilot.answers) <= 251
    answer = autopilot.answers[-1]
    assert close(answer.moment, MOMENT)
    assert (answer.correction, answer.age) == ((0.0, 0.0, 0.0), -1.0)
    autopilot.run(6.0)
    before = len(autopilot.answers)
    autopilot.run(1.0)
    assert len(autopilot.answers) == before


@pytest.mark.parametrize("who", [{"system": 2}, {"component": 190}])
def test_the_heartbeat_of_another_gets_no_answer(who):
    autopilot = Autopilot()
    autopilot.greet(**who)
    autopilot.run(0.5)
    assert autopilot.answers == []


def test_a_heartbeat_is_no_news_of_a_correction():
    autopilot = ready()
    autopilot.converse(0.1, 0.1)
    for _ in range(50):
        autopilot.greet()
        autopilot.run(0.004)
    assert close(autopilot.added(), 0.0)


@pytest.mark.parametrize("wraps", [1, 5])
def test_stamps_go_on_when_the_clock_of_32_bits_wraps(wraps):
    autopilot = Autopilot(now_us=wraps * 2**32 - 3_000_000, moment=MOMENT)
    autopilot.run(1.6)
    autopilot.converse(1.0, 0.0)
    for _ in range(250):
        autopilot.converse(0.004, 0.03)
        answer = autopilot.answers[-1]
        assert answer.stamp_us == autopilot.now_us
        assert answer.age == pytest.approx(2.0)
    assert autopilot.now_us > wraps * 2**32
    assert close(autopilot.added(), (0.03, 0.0, 0.0))


# What is taken up -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "message",
    [
        {"component": 190},
        {"system": 2},
        {"name": b"DOB"},
        {"name": b"DOB_CORR2"},
        {"x": math.nan},
        {"y": math.inf},
        {"z": -1.01},
        {"age_us": -500_000},
        {"age_us": -(2**32)},
        {"stamp_us": 0},
    ],
)
def test_a_message_is_ignored_whole_and_is_no_news(message):
    autopilot = ready()
    autopilot.converse(0.1, 0.02)
    for _ in range(100):
        autopilot.hear(**({"x": 0.1} | message))
        autopilot.run(0.004)
    assert close(autopilot.added(), 0.0)


def test_the_newest_stamp_wins():
    autopilot = ready()
    autopilot.converse(0.1, 0.02)
    autopilot.hear(0.05, age_us=4000)
    autopilot.hear(0.07, age_us=4000)
    autopilot.hear(0.09, age_us=8000)
    autopilot.run(0.004)
    assert close(autopilot.added(), (0.05, 0.0, 0.0))


def test_a_correction_is_clipped_at_the_limits_and_the_answer_says_so():
    autopilot = ready(parameters={"DOBC_LIMIT": 0.05, "DOBC_LIMIT_Y": 0.1})
    autopilot.converse(0.1, 0.3, -0.3, 0.3)
    assert close(autopilot.added(), (0.05, -0.05, 0.1))
    assert close(autopilot.answers[-1].correction, (0.05, -0.05, 0.1))


def test_a_higher_limit_is_moved_to_slowly():
    autopilot = ready(parameters={"DOBC_LIMIT": 0.05})
    autopilot.parameters["DOBC_LIMIT"] = 0.3
    before = 0.05
    for _ in range(500):
        autopilot.converse(0.004, 0.3)
        assert autopilot.added()[0] - before < 0.001
        before = autopilot.added()[0]
    assert before > 0.2


# How it ends ----------------------------------------------------------------------------------------------------------


def test_silence_is_held_for_100_ms_and_faded_within_another_100_ms():
    autopilot = ready()
    autopilot.converse(0.1, 0.1)
    autopilot.run(0.096)
    assert close(autopilot.added(), (0.1, 0.0, 0.0))
    last = autopilot.added()[0]
    for _ in range(27):
        autopilot.run(0.004)
        assert autopilot.added()[0] <= last + 1e-9
        last = autopilot.added()[0]
    assert set(autopilot.factors["throttle"].values()) == {1.0}


@pytest.mark.parametrize(("run_us", "waiting_us"), [(1000, 0), (4000, 0), (3000, 3000), (2000, 10_000)])
def test_however_long_a_run_takes_silence_is_over_within_200_ms(run_us, waiting_us):
    autopilot = ready()
    autopilot.converse(0.1, 0.1)
    autopilot.run(0.0, 0)  # the last news is taken, and acts from here on
    heard_us, autopilot.writing_us = autopilot.now_us, waiting_us
    while autopilot.added()[0] > 0.09999:
        autopilot.run(0.0, run_us)
    assert autopilot.now_us - heard_us > 100_000 - 2 * (run_us + waiting_us)
    while set(autopilot.factors["throttle"].values()) != {1.0}:
        autopilot.run(0.0, run_us)
    assert autopilot.now_us - heard_us <= 200_000 + waiting_us


def test_a_companion_that_comes_back_with_a_correction_does_not_step_up():
    autopilot = ready()
    autopilot.converse(0.1, 0.1)
    autopilot.run(0.3)
    autopilot.converse(0.1, 0.1)
    assert 0.0 < autopilot.added()[0] <= 0.1 * 0.1 / 0.5 + 0.001
    autopilot.converse(0.5, 0.1)
    assert close(autopilot.added(), (0.1, 0.0, 0.0))


@pytest.mark.parametrize(
    "change",
    [
        {"armed": False},
        {"flying": False},
        {"spool_state": 4},
    ],
)
def test_on_the_ground_nothing_is_let_in(change):
    autopilot = ready()
    autopilot.converse(0.1, 0.1)
    for name, value in change.items():
        setattr(autopilot, name, value)
    autopilot.converse(0.2, 0.1)
    assert close(autopilot.added(), 0.0)


def test_the_pilots_switch_fades_it_out_and_back_in():
    autopilot = ready(switch_assigned=True, switch=2)
    autopilot.converse(0.1, 0.1)
    assert close(autopilot.added(), (0.1, 0.0, 0.0))
    autopilot.switch = 0
    autopilot.converse(0.048, 0.1)
    assert 0.0 < autopilot.added()[0] < 0.06
    autopilot.converse(0.06, 0.1)
    assert close(autopilot.added(), 0.0)
    assert autopilot.texts[-1] == "DOBC: off by RC switch"
    autopilot.switch = 2
    autopilot.converse(0.1, 0.1)
    assert 0.0 < autopilot.added()[0] < 0.03


def test_a_switch_that_is_assigned_but_was_never_seen_is_off():
    autopilot = ready(switch_assigned=True)
    autopilot.converse(0.6, 0.1)
    assert close(autopilot.added(), 0.0)


def test_disabled_it_answers_and_adds_nothing():
    autopilot = ready(parameters={"DOBC_ENABLE": 0})
    autopilot.converse(0.6, 0.1)
    assert close(autopilot.added(), 0.0)
    assert close(autopilot.answers[-1].moment, MOMENT)
    assert autopilot.refusal is None


def test_at_zero_throttle_nothing_is_added():
    autopilot = ready()
    autopilot.throttle, autopilot.moment = 0.0, (0.0, 0.0, 0.0)
    autopilot.converse(0.1, 0.1)
    assert set(autopilot.factors["throttle"].values()) == {1.0}


# Room -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("throttle", [0.12, 0.3, 0.9])
def test_no_motor_is_driven_beyond_its_range_and_the_answer_is_what_acts(throttle):
    autopilot = ready()
    autopilot.throttle, autopilot.moment = throttle, (0.1, 0.05, 0.0)
    autopilot.converse(0.1, 0.15, 0.15, 0.3)
    thrusts = autopilot.thrusts()
    assert np.all((thrusts >= -1e-6) & (thrusts <= 1 + 1e-6))
    answer = autopilot.answers[-1]
    assert close(answer.correction, autopilot.added())
    assert close(answer.moment, autopilot.acting())
    assert answer.correction[0] / 0.15 == pytest.approx(answer.correction[2] / 0.3)  # in the direction that was asked


@pytest.mark.parametrize("pitch", [0.8, -0.8])
def test_a_motor_that_takes_no_part_in_an_axis_does_not_take_its_correction(pitch):
    autopilot = ready(parameters={"FRAME_TYPE": 0})  # plus: roll and pitch have two motors each
    autopilot.moment, autopilot.throttle = (0.0, pitch, 0.0), 0.4
    autopilot.converse(0.1, 0.05)
    assert close(autopilot.answers[-1].correction, (0.05, 0.0, 0.0))


def test_a_saturated_controller_is_told_as_the_mixer_leaves_it():
    autopilot = ready()
    autopilot.moment, autopilot.throttle = (1.0, 1.0, 0.0), 0.5
    autopilot.converse(0.1, 0.0)
    assert close(autopilot.answers[-1].moment, (0.5, 0.5, 0.0))  # motors 2 and 3 are 2.0 apart


# Errors ---------------------------------------------------------------------------------------------------------------


def test_an_error_takes_the_correction_out_at_once_and_stays_until_a_reboot():
    autopilot = ready()
    autopilot.converse(0.1, 0.1)
    autopilot.broken = "get_throttle"
    autopilot.run(0.004)
    assert set(autopilot.factors["throttle"].values()) == {1.0}
    assert any("get_throttle broke" in text for text in autopilot.texts)
    autopilot.broken = ""
    autopilot.converse(1.0, 0.1)
    assert close(autopilot.added(), 0.0)
    assert autopilot.refusal == "DOBC: script error, nothing is added"


def test_a_script_that_is_ended_from_outside_leaves_no_correction_behind():
    autopilot = ready()
    autopilot.converse(0.1, 0.1)
    assert close(autopilot.added(), (0.1, 0.0, 0.0))
    autopilot.end()
    assert close(autopilot.added(), 0.0)


# Tail-sitters ---------------------------------------------------------------------------------------------------------


def tailsitter(**changes) -> Autopilot:
    return ready(kind=PLANE, parameters={"Q_TAILSIT_ENABLE": 1}, **changes)


def test_a_quadplane_has_its_own_frame_parameters():
    autopilot = tailsitter()
    autopilot.converse(0.1, 0.1)
    assert close(autopilot.added(), (0.1, 0.0, 0.0))


@pytest.mark.parametrize("change", [{"vtol": False}, {"pitch": 0.5}])
def test_out_of_hover_the_correction_fades(change):
    autopilot = tailsitter()
    autopilot.converse(0.1, 0.1)
    for name, value in change.items():
        setattr(autopilot, name, value)
    autopilot.converse(0.2, 0.1)
    assert close(autopilot.added(), 0.0)


def test_after_forward_flight_hover_begins_where_the_motors_listen_to_the_mixer_again():
    autopilot = ready(kind=PLANE, parameters={"Q_TAILSIT_ENABLE": 1, "Q_TAILSIT_ANGLE": 50, "Q_TAILSIT_ANG_VT": 70})
    for vtol, degrees, acts in (
        (True, 60, True),
        (False, 60, False),
        (True, 60, False),
        (True, 72, True),
        (True, 60, True),
    ):
        autopilot.vtol, autopilot.pitch = vtol, math.radians(degrees)
        autopilot.converse(0.6, 0.1)
        assert close(autopilot.added()[0], 0.1 if acts else 0.0)
    autopilot.parameters["Q_TAILSIT_ANG_VT"] = 0  # then Q_TAILSIT_ANGLE holds both ways
    autopilot.vtol = False
    autopilot.converse(0.6, 0.1)
    autopilot.vtol, autopilot.pitch = True, math.radians(52)
    autopilot.converse(0.6, 0.1)
    assert close(autopilot.added()[0], 0.1)

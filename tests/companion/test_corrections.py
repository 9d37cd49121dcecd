"""What leaves the companion as a correction (docs/interfaces.md, On the wire: the companion)."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import Companion, CompanionConfig
from dob_companion.supervisor import State
from tests.companion.aircraft import AT_ONCE, DT, Aircraft, aircraft, corrections, small_design, texts


def xyz(message):
    return message.x, message.y, message.z


def test_every_gyro_sample_gets_exactly_one_answer_with_its_stamp_and_it_is_zero_while_off():
    plane = aircraft()
    plane.heartbeat()
    plane.rates = (0.3, -0.2, 0.1)
    stamps = []
    for _ in range(50):
        stamps.append(plane.stamp)
        (answer,) = plane.pair()
        assert answer.time_usec == stamps[-1]
        assert xyz(answer) == (0.0, 0.0, 0.0)
    assert np.any(np.array(plane.companion.status().d_hat) != 0.0)


def test_the_answer_needs_the_moment_of_the_sample_before_and_not_its_own():
    plane = aircraft().active()
    plane.write("DOB_GAIN", 1.0)
    plane.rates = (0.0, 0.0, 0.0)
    plane.pairs(100)
    first = plane.deliver(plane.imu(rates=(0.2, 0.0, 0.0)))
    assert xyz(corrections(first)[0]) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)  # D_y = 0: not yet visible
    plane.deliver(plane.target(moment=(0.1, 0.0, 0.0)))
    plane.sample += 1
    (second,) = corrections(plane.deliver(plane.imu(rates=(0.0, 0.0, 0.0))))
    assert second.x == pytest.approx(-0.5 * (0.2 - 0.1), abs=1e-6)


def test_a_repeated_pair_is_answered_identically_and_not_stepped():
    plane = aircraft().active()
    plane.rates = (0.1, 0.2, 0.3)
    plane.pairs(3)
    plane.sample -= 1
    stepped = plane.companion.status().stepped
    heard = plane.deliver(plane.imu(), plane.target())
    (answer,) = corrections(heard)
    last = corrections(plane.said[: -len(heard)])[-1]
    assert (answer.time_usec, xyz(answer)) == (last.time_usec, xyz(last))
    assert plane.companion.status().stepped == stepped


def test_late_samples_are_dropped_and_counted():
    plane = aircraft().active()
    before = plane.companion.status()
    assert corrections(plane.deliver(plane.imu(stamp=plane.stamp - 5 * 4000))) == []
    assert plane.companion.status().late == before.late + 1
    assert plane.companion.status().stepped == before.stepped


def test_the_fade_moves_by_no_more_than_the_ramp_allows_and_ends_exactly():
    plane = aircraft(AT_ONCE)
    plane.heartbeat()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(600)
    plane.write("DOB_ENABLE", 1.0)
    up = [c.x for c in plane.pairs(300)]
    plane.write("DOB_ENABLE", 0.0)
    down = [c.x for c in plane.pairs(300)]
    steps = np.abs(np.diff(up + down))
    assert max(steps) <= 0.2 * DT / 0.5 + 1e-6
    assert up[-1] == pytest.approx(-0.2, rel=1e-6)
    assert down[-1] == 0.0
    assert down[126] == 0.0
    assert plane.companion.status().state is State.DISABLED


def test_the_correction_is_clipped_at_the_limit():
    plane = aircraft().active()
    plane.rates = (0.8, -0.8, 0.1)
    last = plane.pairs(100)[-1]
    assert xyz(last) == pytest.approx((-0.3, 0.3, -0.1), abs=1e-6)


def test_a_masked_axis_fades_to_exactly_zero_and_back_while_the_others_go_on():
    plane = aircraft().active()
    plane.rates = (0.1, 0.1, 0.1)
    plane.pairs(100)
    plane.write("DOB_AXES", 5.0)
    faded = plane.pairs(200)
    assert max(abs(np.diff([c.y for c in faded]))) <= 0.1 * DT / 0.5 + 1e-6
    assert xyz(faded[-1]) == pytest.approx((-0.1, 0.0, -0.1), abs=1e-6)
    assert faded[-1].y == 0.0
    plane.write("DOB_AXES", 7.0)
    assert plane.pairs(200)[-1].y == pytest.approx(-0.1, abs=1e-6)


def test_an_axis_without_a_block_is_never_corrected():
    plane = aircraft(axes=("pitch",)).active()
    plane.rates = (0.2, 0.2, 0.2)
    last = plane.pairs(100)[-1]
    assert (last.x, last.z) == (0.0, 0.0)
    assert last.y == pytest.approx(-0.2, abs=1e-6)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_a_gyro_rate_that_is_not_finite_zeroes_at_once_and_latches_a_fault(bad):
    plane = aircraft().active()
    plane.rates = (0.2, 0.2, 0.2)
    plane.pairs(50)
    (answer,) = corrections(plane.deliver(plane.imu(rates=(0.2, bad, 0.2))))
    assert xyz(answer) == (0.0, 0.0, 0.0)
    plane.sample += 1
    plane.pairs(1000)
    assert plane.companion.status().state is State.FAULT
    assert all(xyz(c) == (0.0, 0.0, 0.0) for c in corrections(plane.said)[-1000:])
    assert any("not finite" in text for text in texts(plane.said))
    plane.write("DOB_ENABLE", 0.0)
    plane.pair()
    assert plane.companion.status().state is State.DISABLED
    plane.write("DOB_ENABLE", 1.0)
    plane.until(State.ACTIVE)


def test_an_applied_moment_that_is_not_finite_never_reaches_a_correction():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    plane.deliver(plane.imu(), plane.target(moment=(float("nan"), 0.0, 0.0)))
    plane.sample += 1
    assert all(xyz(c) == (0.0, 0.0, 0.0) for c in plane.pairs(500))
    assert plane.companion.status().state is State.FAULT


def test_one_lost_sample_is_bridged_and_counted_and_the_state_stays_active():
    plane = aircraft().active()
    plane.rates = (0.1, 0.1, 0.1)
    plane.pairs(20)
    plane.sample += 1
    (answer,) = plane.pair()
    assert plane.companion.status().bridged == 1
    assert plane.companion.status().state is State.ACTIVE
    assert answer.x == pytest.approx(-0.1, abs=1e-3)


def test_a_lost_moment_is_bridged_by_the_one_before():
    plane = aircraft().active()
    plane.pairs(20)
    plane.deliver(plane.imu())
    plane.sample += 1
    plane.pairs(5)
    assert plane.companion.status().bridged == 1
    assert plane.companion.status().state is State.ACTIVE


def test_a_gap_fades_the_last_correction_without_recomputing_it():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    plane.sample += 10
    plane.rates = (-5.0, 0.0, 0.0)
    faded = [c.x for c in plane.pairs(126)]
    assert all(-0.2 - 1e-6 <= x <= 0.0 for x in faded)
    assert np.all(np.diff(faded) >= -1e-9)
    assert faded[125] == 0.0
    assert any("gap in samples" in text for text in texts(plane.said))


def test_a_stream_of_moments_that_stops_fades_the_correction():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    heard = []
    for _ in range(200):
        heard += plane.deliver(plane.imu())
        plane.sample += 1
        plane.now += DT
    answers = corrections(heard)
    assert len(answers) == 200
    assert answers[-1].x == 0.0


def test_in_silence_nothing_is_sent_but_zeros_with_extrapolated_stamps_and_these_end():
    plane = aircraft().active()
    plane.write("DOB_RAMP_S", 10.0)
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    newest, heard, since = plane.stamp - 4000, [], plane.now
    while plane.now < since + 5.0:
        plane.now = plane.companion.next_deadline()
        heard += corrections(plane.listen())
    stamps = [c.time_usec for c in heard]
    assert {xyz(c) for c in heard} == {(0.0, 0.0, 0.0)}
    assert stamps[0] - newest == pytest.approx(500_000, abs=8000)
    assert np.all(np.diff(stamps) == 4000)
    assert stamps[-1] - stamps[0] == pytest.approx(500_000, abs=8000)
    assert plane.companion.status().state is State.WAITING


def test_a_loop_that_stood_still_for_long_does_not_make_up_for_the_zeros_that_it_did_not_send():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    plane.now += 60.0
    assert len(corrections(plane.listen())) <= 0.5 / DT + 2


def test_the_pause_of_a_vehicle_in_lockstep_that_repeats_its_pair_is_no_silence():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    plane.sample -= 1
    for _ in range(20):
        plane.now += 0.2
        (answer,) = corrections(plane.deliver(plane.imu(), plane.target()))
        assert answer.x == pytest.approx(-0.2, rel=1e-6)
    plane.sample += 1
    plane.pairs(10)
    assert plane.companion.status().state is State.ACTIVE


def test_a_simulation_that_is_held_up_is_not_silent_before_it_would_give_up_itself():
    """Its HEARTBEAT says hardware in the loop: a busy computer must not change its flight."""
    plane = aircraft()
    plane.simulated = True
    plane.active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    plane.now += 4.9
    assert corrections(plane.listen()) == []
    (answer,) = plane.pair()
    assert answer.x == pytest.approx(-0.2, rel=1e-6)
    assert plane.companion.status().state is State.ACTIVE
    plane.now += 5.1
    assert all(xyz(zero) == (0.0, 0.0, 0.0) for zero in corrections(plane.listen()))
    assert plane.companion.status().state is not State.ACTIVE


@pytest.mark.parametrize("ramp_s", [0.5, 5.0])
def test_closing_fades_within_half_a_second_whatever_the_ramp_and_ends_with_a_zero(ramp_s):
    plane = aircraft().active()
    plane.write("DOB_RAMP_S", ramp_s)
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    plane.companion.close(plane.now)
    closing = []
    while not plane.companion.closed:
        closing += plane.pair()
    assert max(abs(np.diff([c.x for c in closing]))) <= 0.2 * DT / 0.5 + 1e-6
    assert xyz(closing[-1]) == (0.0, 0.0, 0.0)


def test_closing_without_samples_leaves_the_fade_to_the_vehicle_and_ends_with_a_zero_that_it_takes():
    plane = aircraft().active()
    plane.rates = (0.2, 0.0, 0.0)
    plane.pairs(50)
    began, newest = plane.now, plane.stamp - 4000
    plane.companion.close(plane.now)
    heard = []
    while not plane.companion.closed:
        plane.now = min(plane.companion.next_deadline(), plane.now + 0.1)
        heard += corrections(plane.listen())
    assert plane.now - began <= 0.6
    assert {xyz(c) for c in heard} == {(0.0, 0.0, 0.0)}
    assert heard[-1].time_usec > newest + 200_000


def test_set_actuator_control_target_carries_the_same_correction_when_the_config_says_so():
    plane = aircraft(CompanionConfig(correction_message="SET_ACTUATOR_CONTROL_TARGET")).active()
    plane.rates = (0.1, 0.2, -0.1)
    plane.pairs(100)
    message = [m for m in plane.said if m.get_type() == "SET_ACTUATOR_CONTROL_TARGET"][-1]
    assert (message.group_mlx, message.target_system, message.target_component) == (2, 1, 1)
    assert message.controls[:3] == pytest.approx([-0.1, -0.2, 0.1], abs=1e-6)
    assert corrections(plane.said) == []


def test_the_same_bytes_in_give_the_same_bytes_out():
    def flight():
        plane = Aircraft(Companion(small_design(), CompanionConfig()))
        rng = np.random.default_rng(7)
        plane.heartbeat()
        for k in range(1200):
            plane.rates = tuple(rng.normal(0, 0.1, 3))
            plane.moment = tuple(rng.normal(0, 0.1, 3))
            if k == 700:
                plane.write("DOB_ENABLE", 1.0)
            plane.pair()
        return b"".join(bytes(m.get_msgbuf()) for m in plane.said if m.get_type() != "HEARTBEAT")

    assert flight() == flight()


def test_sensor_data_of_another_system_or_component_are_not_obeyed():
    plane = aircraft().active()
    stranger = mav.MAVLink(None, srcSystem=2, srcComponent=1)
    sibling = mav.MAVLink(None, srcSystem=1, srcComponent=100)
    for voice in (stranger, sibling):
        assert corrections(plane.deliver(plane.imu(), plane.target(), by=voice)) == []
    assert plane.companion.status().foreign >= 4


def test_garbage_between_messages_is_counted_and_changes_nothing():
    plane = aircraft().active()
    before = plane.companion.status()
    plane.companion.receive(b"\xfd\xff\x00garbage" * 5, plane.now)
    plane.companion.receive(bytes(plane.imu().pack(plane.out))[:-3], plane.now)
    plane.pairs(5)
    after = plane.companion.status()
    assert after.bad > before.bad
    assert after.stepped == before.stepped + 5
    assert after.gaps == before.gaps


def test_a_clock_that_jumps_back_with_a_sample_that_is_not_finite_is_measured_anew():
    plane = aircraft().active()
    plane.sample -= 1000
    plane.rates = (float("nan"), 0.0, 0.0)
    plane.pair()
    plane.rates = (0.0, 0.0, 0.0)
    plane.pairs(10)
    assert plane.companion.status().rate_hz == pytest.approx(250.0)

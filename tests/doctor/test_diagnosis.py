"""What doctor makes of good links and bad ones, in simulated time with real MAVLink bytes."""

import heapq
import math
from dataclasses import replace

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega
from pymavlink.dialects.v20 import common as mav

from dob_companion.artifact import StateSpaceData
from dob_companion.cli.doctor import _as_text
from dob_companion.doctor.diagnosis import Verdict
from dob_companion.doctor.streamlog import StreamLog
from dob_companion.mavlink.signing import SigningGate
from tests.companion.aircraft import small_design
from tests.doctor.road import Road


def missing(diagnosis, topic):
    return [f for f in diagnosis.findings if f.topic == topic and f.verdict is Verdict.MISSING]


def texts(diagnosis, topic):
    return " | ".join(f.text for f in diagnosis.findings if f.topic == topic)


def test_a_good_link_is_fit_and_the_sitl_profile_fits():
    diagnosis, _ = Road(design=small_design()).listen()
    assert (diagnosis.fit, diagnosis.profile) == (True, "sitl")
    assert "250.0 Hz by its stamps" in texts(diagnosis, "gyro")
    assert "regular, 4 ms" in texts(diagnosis, "stamps")
    assert "0.5 ms in the median" in texts(diagnosis, "delay")


def test_it_sends_heartbeats_requests_and_timesync_only_and_leaves_the_streams_as_they_were():
    road = Road()
    road.listen()
    assert {m.get_type() for m in road.sent} == {"HEARTBEAT", "COMMAND_LONG", "TIMESYNC"}
    commands = [m for m in road.sent if m.get_type() == "COMMAND_LONG"]
    assert {m.command for m in commands} == {mav.MAV_CMD_SET_MESSAGE_INTERVAL}
    asked = {m.param1 for m in commands if m.param2 > 0}
    assert {m.param1 for m in commands[-len(asked) :] if m.param2 == 0} == asked


def test_every_finding_that_something_is_missing_has_a_remedy_of_one_line():
    for road in (Road(heartbeat=False), Road(moments=False), Road(timesync=False), Road(late_s=0.1), Road(deaf=True)):
        diagnosis, _ = road.listen()
        for finding in diagnosis.findings:
            assert "\n" not in finding.text + finding.remedy
            assert finding.remedy or finding.verdict is not Verdict.MISSING, finding


def test_silence_is_not_fit():
    diagnosis, _ = Road(heartbeat=False).listen()
    assert not diagnosis.fit
    assert "nothing is heard" in texts(diagnosis, "autopilot")


def test_somebody_who_is_no_autopilot_is_not_enough():
    gimbal = mav.MAVLink(None, srcSystem=1, srcComponent=154)
    road = Road(heartbeat=False)
    road.at(0.5, mav.MAVLink_heartbeat_message(26, 8, 0, 0, 3, 3), gimbal)
    diagnosis, _ = road.listen()
    assert "only 1/154 heard" in texts(diagnosis, "autopilot")


def test_steps_of_2_5_and_5_ms_are_named_and_their_rate_is_enough():
    diagnosis, _ = Road(autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA, steps_us=(2500, 5000)).listen()
    assert "steps of 2.5 and 5 ms" in texts(diagnosis, "stamps")
    assert not missing(diagnosis, "gyro")


def test_a_clock_that_drifts_by_0_4_percent_is_noted_with_its_error():
    diagnosis, _ = Road(drift=0.004).listen(seconds=5.0)
    assert "0.40 ± 0.0" in texts(diagnosis, "clock")
    assert diagnosis.fit


def test_a_clock_that_runs_at_half_speed_is_not_fit():
    assert missing(Road(drift=-1.0).listen()[0], "clock")


@pytest.mark.parametrize(("shift_us", "offset"), [(5_000_000, "+5.0 s"), (-5_000_000, "-5.0 s"), (100_000, "+0.100 s")])
def test_moments_stamped_by_another_clock_than_the_gyro_are_named_and_not_fit(shift_us, offset):
    diagnosis, _ = Road(shift_us=shift_us, design=small_design()).listen()
    (finding,) = missing(diagnosis, "clock")
    assert finding.text == f"moments are stamped by another clock than the gyro: {offset}"
    assert not diagnosis.fit


@pytest.mark.parametrize("shift_us", [-8000, 0, 8000])
def test_moments_two_samples_beside_the_gyro_are_of_one_clock(shift_us):
    diagnosis, _ = Road(shift_us=shift_us, design=small_design()).listen()
    assert not missing(diagnosis, "clock")


def test_a_doctor_that_listens_for_ever_keeps_a_bounded_record():
    log = StreamLog("HIGHRES_IMU")
    for k in range(70_000):
        log.add(0.004 * k, 4000 * k, True)
    assert len(log.wall) == len(log.stamps) <= 65_536
    assert log.rate_by_stamp_hz == pytest.approx(250.0)


def test_full_rate_a_third_of_a_second_late_is_not_fit():
    diagnosis, _ = Road(late_s=0.178, design=small_design()).listen()
    assert not missing(diagnosis, "gyro")
    (finding,) = missing(diagnosis, "delay")
    assert "356" in finding.text
    assert "921600" in finding.remedy


def test_a_stream_at_200_hz_is_too_slow():
    diagnosis, _ = Road(autopilot=mav.MAV_AUTOPILOT_PX4, steps_us=(5000,)).listen()
    (finding,) = missing(diagnosis, "gyro")
    assert "200.0 Hz" in finding.text
    assert "IMU_INTEG_RATE" in finding.remedy


@pytest.mark.parametrize(
    ("autopilot", "profile", "words"),
    [
        (mav.MAV_AUTOPILOT_PX4, "px4", "deploy/px4"),
        (mav.MAV_AUTOPILOT_ARDUPILOTMEGA, "ardupilot", "Lua"),
        (mav.MAV_AUTOPILOT_GENERIC, None, "docs/interfaces.md"),
    ],
)
def test_a_stock_autopilot_is_told_what_its_side_lacks(autopilot, profile, words):
    diagnosis, _ = Road(autopilot=autopilot, moment_name="SERVO_OUTPUT_RAW").listen()
    assert (diagnosis.fit, diagnosis.profile) == (False, profile)
    (finding,) = missing(diagnosis, "profile")
    assert words in finding.remedy


@pytest.mark.parametrize(
    "road",
    [{}, {"deaf": True}, {"shift_us": 400_000}, {"autopilot": mav.MAV_AUTOPILOT_ARDUPILOTMEGA, "moment_name": "NONE"}],
)
def test_what_is_printed_fits_80_columns(road):
    diagnosis, listening = Road(**road).listen()
    lines = list(_as_text(listening, diagnosis))
    assert len(lines) > 10
    assert max(map(len, lines)) <= 80, max(lines, key=len)


def test_refused_and_unanswered_requests_are_said():
    refused, _ = Road(refuses=(mav.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET,)).listen()
    assert "ACTUATOR_CONTROL_TARGET: the vehicle refuses" in texts(refused, "requests")
    unanswered, _ = Road(deaf=True).listen()
    assert "HIGHRES_IMU: the request for its rate is not answered" in texts(unanswered, "requests")


@pytest.mark.parametrize("acks", [2, 3])
def test_an_acknowledgement_that_comes_twice_answers_one_request_and_no_stream_is_left_out(acks):
    refused = mav.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET
    road = Road(acks=acks, refuses=(refused,), autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA)
    diagnosis, listening = road.listen()
    asked = [m.param1 for m in road.sent if m.get_type() == "COMMAND_LONG" and m.param2 > 0]
    assert len(asked) == len(set(asked)) == 4
    assert listening.answers == {
        "HIGHRES_IMU": True, "RAW_IMU": True, "ACTUATOR_CONTROL_TARGET": False, "SERVO_OUTPUT_RAW": True,
    }  # fmt: skip
    assert texts(diagnosis, "requests") == "ACTUATOR_CONTROL_TARGET: the vehicle refuses to send it at this rate"


def test_a_request_that_is_in_progress_is_neither_refused_nor_answered():
    diagnosis, _ = Road(result=mav.MAV_RESULT_IN_PROGRESS).listen()
    assert "refuses" not in texts(diagnosis, "requests")
    assert "is not answered" in texts(diagnosis, "requests")


@pytest.mark.parametrize(
    ("autopilot", "skips", "fit"),
    [
        (mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 3, True),
        (mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 2, False),
        (mav.MAV_AUTOPILOT_GENERIC, 3, False),
    ],
)
def test_a_script_s_moments_need_not_come_with_every_sample(autopilot, skips, fit):
    diagnosis, _ = Road(autopilot=autopilot, skips=skips).listen()
    assert diagnosis.fit == fit
    assert "gaps" not in texts(diagnosis, "stamps") or not fit


@pytest.mark.parametrize("clock", [-3.0, 3.0, 1e6])
def test_only_answers_to_our_own_timesync_count(clock):
    diagnosis, listening = Road(others_ask=clock).listen()
    assert "0.5 ms in the median" in texts(diagnosis, "delay")
    assert 0 < len(listening.round_trips_s) <= listening.asked_time
    silent, _ = Road(others_ask=clock, timesync=False).listen()
    assert "not known" in missing(silent, "delay")[0].text


def test_a_link_that_sends_back_what_we_say_is_named_and_is_no_other_companion():
    diagnosis, _ = Road(reflects=True).listen()
    assert diagnosis.fit
    assert "messages of our own came back" in texts(diagnosis, "link")
    by = mav.MAVLink(None, srcSystem=1, srcComponent=191)
    other, _ = Road(reflects=True, extra=((by, mav.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)),)).listen()
    assert "another companion is on the link" in missing(other, "companion")[0].text


def test_a_gyro_that_never_changes_and_one_that_is_not_finite_are_not_fit():
    assert missing(Road(rates=lambda _: (0.0, 0.0, 0.0)).listen()[0], "gyro")
    assert missing(Road(rates=lambda k: (0.1 * (k % 2), math.nan, 0.0)).listen()[0], "gyro")


def test_without_timesync_the_delay_is_not_known():
    (finding,) = missing(Road(timesync=False).listen()[0], "delay")
    assert "not known" in finding.text


def test_a_second_autopilot_and_a_second_companion_are_not_fit():
    def beat(system, component, kind, autopilot):
        by = mav.MAVLink(None, srcSystem=system, srcComponent=component)
        return by, mav.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 3, 3)

    diagnosis, _ = Road(extra=(beat(2, 1, 2, 12), beat(1, 191, 18, 8))).listen()
    assert "systems 1, 2" in missing(diagnosis, "autopilot")[0].text
    assert "systemctl stop" in missing(diagnosis, "companion")[0].remedy


def test_corrections_on_the_link_mean_another_companion():
    other = mav.MAVLink(None, srcSystem=1, srcComponent=192)
    diagnosis, _ = Road(extra=((other, mav.MAVLink_debug_vect_message(b"DOB_CORR", 1, 0.1, 0, 0)),), age=1.0).listen()
    assert "1/192" in missing(diagnosis, "companion")[0].text
    assert "1 samples old" in texts(diagnosis, "delay")


KEY = bytes(range(32))


@pytest.mark.parametrize(
    ("signs_with", "ours", "fit", "words"),
    [
        (None, None, True, "does not sign"),
        (KEY, None, True, "with a key not given here"),
        (KEY, KEY, True, "signed with our key"),
        (None, KEY, False, "unsigned"),
        (bytes(32), KEY, False, "wrong"),
    ],
)
def test_what_is_signed_unsigned_or_wrongly_signed_is_said(signs_with, ours, fit, words):
    gate = SigningGate(ours, 0) if ours else None
    diagnosis, listening = Road(key=signs_with, gate=gate).listen()
    assert words in texts(diagnosis, "signing")
    assert (diagnosis.fit, bool(missing(diagnosis, "signing"))) == (fit, not fit)
    assert listening.stream("HIGHRES_IMU").rate_by_stamp_hz == pytest.approx(250.0)


def test_a_stale_clock_of_the_autopilot_is_told_from_a_wrong_key():
    (finding,) = missing(Road(key=KEY, gate=SigningGate(KEY, 10**12)).listen()[0], "signing")
    assert "replayed" in finding.text
    assert "clocks" in finding.remedy


def test_others_who_do_not_sign_are_named():
    ground = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    beat = mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    diagnosis, _ = Road(key=KEY, gate=SigningGate(KEY, 0), extra=((ground, beat),)).listen()
    assert "255/190: nothing signed with our key" in texts(diagnosis, "signing")
    assert diagnosis.fit


def test_messages_of_another_dialect_are_told_from_garbage_by_their_numbers():
    vehicle = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
    rpm, ahrs3 = ardupilotmega.MAVLink_rpm_message(1.0, 2.0), ardupilotmega.MAVLink_ahrs3_message(*[0] * 10)
    extra = ((vehicle, rpm), (vehicle, ahrs3))
    diagnosis, listening = Road(extra=extra).listen()
    assert listening.listener.bad == 0
    beats = listening.listener.unknown.total() // 2
    assert texts(diagnosis, "link") == (
        f"{2 * beats} messages of another MAVLink dialect, left alone: numbers 226, 182"
    )
    assert diagnosis.fit


def test_garbage_is_no_other_dialect():
    road = Road()
    heapq.heappush(road.queue, (0.5, next(road.order), b"no MAVLink at all"))
    diagnosis, listening = road.listen()
    assert "pieces of garbage" in texts(diagnosis, "link")
    assert not listening.listener.unknown


class Responding(Road):
    """Its moment on roll answers its rate as the design's controller would, or with the wrong sign."""

    sign = 1.0

    def sample(self, now, stamp, k):
        rate = math.sin(0.3 * k) + math.sin(0.11 * k)
        self.at(now, mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, rate, 0, 0, *[0] * 7, 56))
        moment = [-0.1 * self.sign * rate, 0, 0, 0.5, 0, 0, 0, -1]
        self.at(now, mav.MAVLink_actuator_control_target_message(stamp, 0, moment))


class ReadByScript(Responding):
    """The same, its moment read between the gyro's samples and not for each, as ArduPilot's script does."""

    def sample(self, now, stamp, k):
        def rate(stamp_us):
            return math.sin(75e-6 * stamp_us) + math.sin(27e-6 * stamp_us)

        self.at(now, mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, rate(stamp), 0, 0, *[0] * 7, 56))
        if k % 3:
            read = stamp + 1200
            moment = [-0.1 * self.sign * rate(read), 0, 0, 0.5, 0, 0, 0, -1]
            self.at(now, mav.MAVLink_actuator_control_target_message(read, 0, moment))


@pytest.mark.parametrize(("sign", "said"), [(1.0, "belong together"), (-1.0, "roll is inverted")])
@pytest.mark.parametrize("kind", [Responding, ReadByScript])
def test_signs_are_judged_where_the_vehicle_moves(kind, sign, said):
    ardupilot = mav.MAV_AUTOPILOT_ARDUPILOTMEGA
    road = kind(design=small_design(axes=("roll",)), autopilot=ardupilot, steps_us=(2500, 5000))
    road.sign = sign
    diagnosis, _ = road.listen(4.0)
    assert said in texts(diagnosis, "signs")
    assert diagnosis.fit == (sign > 0)


@pytest.mark.parametrize(("pole", "well"), [(0.5, False), (0.97, True)])
def test_a_design_that_takes_a_moment_for_known_that_is_read_now_and_then_is_told_of(pole, well):
    """d_hat(k+1) = pole d_hat(k) + (1 - pole) (y_n(k) - u_e(k)), of a plant of gain 1 in a loop of gain 0.1."""
    design = small_design(axes=("roll",))
    observer = StateSpaceData([[pole]], [[1.0 - pole, pole - 1.0]], [[1.0]], [[0.0, 0.0]])
    design = replace(design, blocks=(replace(design.blocks[0], observer=observer),))
    road = ReadByScript(design=design, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA, steps_us=(2500, 5000))
    diagnosis, _ = road.listen(4.0)
    (finding,) = (each for each in diagnosis.findings if each.topic == "readings")
    w = np.linspace(0.01, np.pi, 500)
    back = (1.0 - pole) / np.abs(np.exp(1j * w) - pole) / 1.1 * (1.0 - np.sinc(w / (2 * np.pi * 0.004 * 177.8)) ** 2)
    assert f"comes back as {np.max(back):.2g} of it" in finding.text
    assert ("moment_rate_hz = 178" in finding.remedy) is not well
    asked, _ = Road(design=design).listen()
    assert not texts(asked, "readings")


def test_signs_that_cannot_be_known_are_said_to_be_unknown():
    still, _ = Road(design=small_design(axes=("yaw",))).listen()
    assert "yaw: cannot be known" in texts(still, "signs")
    blind, _ = Road().listen()
    assert "they need a design" in texts(blind, "signs")


def log(stamps_ms):
    stream = StreamLog("X")
    for k, stamp in enumerate(stamps_ms):
        stream.add(0.004 * k, round(1000 * stamp), True)
    return stream


def test_gaps_and_stamps_that_do_not_increase_are_counted():
    stream = log([0, 4, 8, 16, 20, 20, 24, 12, 28])
    assert (stream.gaps, stream.backward) == (2, 2)
    assert log(range(0, 400, 4)).pattern() == "regular, 4 ms"
    assert log([0.01 * k * k for k in range(1, 200)]).pattern().startswith("irregular")


def test_a_stream_of_one_message_has_no_rate():
    stream = log([5])
    assert (stream.rate_by_wall_hz, stream.stamped) == (0.0, False)
    assert math.isnan(stream.rate_by_stamp_hz)
    assert math.isnan(stream.drift_percent()[0])

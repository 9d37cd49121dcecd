"""Telemetry logs and our own recordings, held against pymavlink's decoding of the same messages."""

import os

import numpy as np
import pytest

from dob_companion.errors import LogError
from dob_companion.files.tlog import entry
from dob_companion.logs import read_log
from tests.ardupilot.recorded import DATA, messages

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mav

PX4 = DATA.parent / "px4"
VEHICLE = mav.MAVLink(None, srcSystem=1, srcComponent=1)
BEAT = mav.MAVLink_heartbeat_message(2, 3, 209, 0, 4, 3)


def first_of_each(values):
    """In order of their stamps, the first of those with one stamp."""
    kept = {}
    for stamp, row in values:
        kept.setdefault(stamp, row)
    return [kept[stamp] for stamp in sorted(kept)]


@pytest.mark.parametrize("piece", ["copter_enable", "copter_irregular", "copter_ringing"])
def test_an_ardupilot_s_log_holds_what_its_messages_say(piece):
    (record,) = read_log(DATA / f"{piece}.tlog")
    told = list(messages(piece, 1))
    gyro = first_of_each((m.time_usec, (m.xgyro, m.ygyro, m.zgyro)) for m in told if m.get_type() == "HIGHRES_IMU")
    target = [m for m in told if m.get_type() == "ACTUATOR_CONTROL_TARGET"]
    assert np.array_equal(record.rates.values, gyro)
    assert np.array_equal(record.moment.values, first_of_each((m.time_usec, m.controls[:3]) for m in target))
    assert np.array_equal(record.injected.values, first_of_each((m.time_usec, m.controls[4:7]) for m in target))
    assert (record.make, record.vehicle, record.rates_filtered) == ("ArduPilot", "quadrotor", True)
    assert record.flying.at(record.rates.time[-1:]).all()
    assert record.armed.at(record.rates.time[-1:]).all()


def test_a_ground_station_that_is_not_armed_does_not_disarm_the_vehicle():
    (record,) = read_log(DATA / "copter_enable.tlog")
    assert record.armed.holds.all()


def test_a_px4_s_log_holds_what_its_messages_say():
    (record,) = read_log(PX4 / "sih_sine.tlog")
    told = list(messages("sih_sine", 1, PX4))
    applied = [m for m in told if m.get_type() == "DEBUG_FLOAT_ARRAY" and m.name == "DOB_ACT"]
    attitude = [(m.roll, m.pitch, m.yaw) for m in told if m.get_type() == "ATTITUDE"]
    assert np.array_equal(record.moment.values, first_of_each((m.time_usec, m.data[:3]) for m in applied))
    assert np.array_equal(record.injected.values, first_of_each((m.time_usec, m.data[4:7]) for m in applied))
    assert np.array_equal(record.attitude.values, attitude)
    assert (record.make, record.rates_filtered) == ("PX4", False)


def flight(begin_us, samples, seed=0):
    """Frames of a vehicle from its boot on."""
    rng = np.random.default_rng(seed)
    said = [BEAT, mav.MAVLink_param_value_message(b"INS_GYRO_FILTER", 20.0, 9, 1, 0)]
    for k in range(samples):
        stamp, rates = begin_us + 4000 * k, rng.normal(0.0, 0.1, 3)
        said.append(mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, *rates, 0, 0, 0, 0, 0, 0, 0, 0))
        said.append(mav.MAVLink_actuator_control_target_message(stamp, 0, [*rates, 0.5, 0, 0, 0, 1.0]))
    return [bytes(message.pack(VEHICLE)) for message in said]


def write(path, frames_in, step_s=0.002):
    path.write_bytes(b"".join(entry(1.7e9 + step_s * k, frame) for k, frame in enumerate(frames_in)))
    return path


def packed(*said):
    return [bytes(message.pack(VEHICLE)) for message in said]


@pytest.mark.parametrize(("quadplane", "vehicle"), [(0.0, "plane"), (1.0, "vtol plane")])
def test_a_plane_with_lifting_rotors_is_a_vtol(tmp_path, quadplane, vehicle):
    plane = mav.MAVLink_heartbeat_message(1, 3, 209, 15, 4, 3)
    told = mav.MAVLink_param_value_message(b"Q_ENABLE", quadplane, 9, 1, 0)
    (record,) = read_log(write(tmp_path / "x.tlog", packed(plane, told) + flight(0, 100)[1:]))
    assert record.vehicle == vehicle


def test_a_vtol_flies_for_us_only_while_it_says_that_it_is_a_multicopter(tmp_path):
    multicopter, to_plane, plane, in_air = 3, 1, 4, 2
    said = [flight(400_000 * k, 100) for k in range(3)]
    states = [packed(mav.MAVLink_extended_sys_state_message(vtol, in_air)) for vtol in (multicopter, to_plane, plane)]
    log = write(
        tmp_path / "x.tlog", [frame for pair in zip(states, said, strict=True) for each in pair for frame in each]
    )
    (record,) = read_log(log)
    assert record.flying.at(np.array([0.2, 0.6, 1.0])).tolist() == [True, False, False]


def test_a_reboot_gives_two_records(tmp_path):
    log = write(tmp_path / "x.tlog", [*flight(50_000_000, 500), *flight(2_000_000, 300, seed=1)])
    first, second = read_log(log)
    assert (len(first.rates.time), len(second.rates.time)) == (500, 300)
    assert second.parameters == {"INS_GYRO_FILTER": 20.0}
    assert "part 2 of 2: the clock begins anew" in second.remarks


def test_a_few_samples_of_the_boot_before_do_not_get_among_those_of_the_next(tmp_path):
    """Their stamps fall into the time of the new boot: put in order with it they would be samples of that flight."""
    log = write(tmp_path / "x.tlog", [*flight(3_100_000, 12, seed=1), *flight(2_000_000, 300)])
    (record,) = read_log(log)
    assert len(record.rates.time) == 300
    assert record.rates.time[-1] == pytest.approx(299 * 0.004)
    assert "1 of 2 parts hold too few samples of rates and moments: left out" in record.remarks


def test_another_vehicle_is_left_out_and_named(tmp_path):
    other = mav.MAVLink(None, srcSystem=7, srcComponent=1)
    log = write(tmp_path / "x.tlog", [*flight(0, 100), bytes(BEAT.pack(other))])
    (record,) = read_log(log)
    assert "other vehicles are heard too, left out: system 7" in record.remarks


def test_damage_between_messages_costs_those_that_it_hits(tmp_path):
    path = write(tmp_path / "x.tlog", flight(0, 100))
    data = path.read_bytes()
    at = data.index(b"\x00\x06", len(data) // 2)
    path.write_bytes(data[:at] + b"noise" * 40 + data[at + 200 :])
    (record,) = read_log(path)
    assert 90 <= len(record.rates.time) < 100
    assert any("left out" in line for line in record.remarks)


def test_signed_messages_are_read(tmp_path):
    signed = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    signed.signing.secret_key, signed.signing.sign_outgoing = b"k" * 32, True
    signed.signing.link_id, signed.signing.timestamp = 1, 1
    plain = mav.MAVLink(None)
    again = [bytes(plain.decode(bytearray(frame)).pack(signed)) for frame in flight(0, 50)]
    (record,) = read_log(write(tmp_path / "x.tlog", again))
    assert len(record.rates.time) == 50
    assert record.parameters == {"INS_GYRO_FILTER": 20.0}


def test_integers_of_px4_s_parameters_are_integers(tmp_path):
    said = flight(0, 50)
    px4_beat = bytes(mav.MAVLink_heartbeat_message(2, 12, 209, 0, 4, 3).pack(VEHICLE))
    (as_float,) = np.array([250], np.int32).view(np.float32)
    rate = bytes(mav.MAVLink_param_value_message(b"IMU_INTEG_RATE", as_float, 6, 1, 0).pack(VEHICLE))
    applied = [
        bytes(mav.MAVLink_debug_float_array_message(4000 * k, b"DOB_ACT", 0, [0.1 * k] * 8 + [0.0] * 50).pack(VEHICLE))
        for k in range(50)
    ]
    (record,) = read_log(write(tmp_path / "x.tlog", [px4_beat, rate, *said[2:], *applied]))
    assert record.parameters == {"IMU_INTEG_RATE": 250.0}


@pytest.mark.parametrize(("make", "flies"), [(3, [False, True]), (12, None)])
def test_without_a_word_of_landing_only_ardupilot_s_heartbeat_tells_of_flight(tmp_path, make, flies):
    """ArduPilot's is active in the air only, PX4's whenever it is armed."""
    said = flight(0, 200)
    applied = [
        bytes(mav.MAVLink_debug_float_array_message(4000 * k, b"DOB_ACT", 0, [0.1] * 8 + [0.0] * 50).pack(VEHICLE))
        for k in range(200)
    ]
    ground, air = (bytes(mav.MAVLink_heartbeat_message(2, make, 209, 0, state, 3).pack(VEHICLE)) for state in (3, 4))
    (record,) = read_log(write(tmp_path / "x.tlog", [ground, *said[1:200], air, *said[200:], *applied]))
    told = None if record.flying is None else record.flying.at(np.array([0.1, 0.7])).tolist()
    assert told == flies


def test_a_log_without_a_heartbeat_or_without_moments_is_refused(tmp_path):
    said = flight(0, 50)
    with pytest.raises(LogError, match="no HEARTBEAT of an autopilot"):
        read_log(write(tmp_path / "x.tlog", said[2:]))
    gyro = [frame for frame in said if frame[7] != 140]
    with pytest.raises(LogError, match="no ACTUATOR_CONTROL_TARGET of system 1, expected it for the applied moment"):
        read_log(write(tmp_path / "x.tlog", gyro))


def test_a_recorded_flight_gives_what_the_telemetry_log_beside_it_gives(tmp_path):
    from dob_companion.files.segments import segments_in
    from tests.recorder.flights import recorded

    with recorded(tmp_path) as plane:
        plane.active()
    (segment,) = segments_in(tmp_path)
    (ours,), (beside,), (newest,) = read_log(segment.trace), read_log(segment.tlog), read_log(tmp_path)
    for record in (beside, newest):
        assert np.array_equal(record.rates.values, ours.rates.values)
        assert np.array_equal(record.moment.values, ours.moment.values)
        assert np.array_equal(record.rates.time, ours.rates.time)
    assert len(ours.rates.time) == plane.sample

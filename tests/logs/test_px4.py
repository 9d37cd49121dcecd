"""PX4's logs, held against pyulog topic by topic."""

import io
import struct

import numpy as np
import pytest
import pyulog

from dob_companion.errors import LogError
from dob_companion.logs import read_log
from dob_companion.logs.ulog import ULog
from tests.logs import writers

TIMES, RATES, MOMENT = writers.some_flight()


def read(tmp_path, data):
    path = tmp_path / "x.ulg"
    path.write_bytes(data)
    return read_log(path)


@pytest.fixture(scope="module")
def data():
    return writers.quad(TIMES, RATES, MOMENT).data


def agrees(data):
    ours, theirs = ULog(data), pyulog.ULog(io.BytesIO(data))
    assert theirs.data_list
    for topic in theirs.data_list:
        table = ours.table(topic.name, topic.multi_id)
        for column in table.names:
            if "_padding" not in column:
                values = topic.data[column].astype(np.float64)
                assert np.array_equal(table.column(column), values, equal_nan=True), (topic.name, column)
    assert {name: value for _, name, value in ours.settings if name in theirs.initial_parameters} == {
        **theirs.initial_parameters,
        **{name: value for _, name, value in theirs.changed_parameters},
    }


def test_every_number_is_the_one_that_pyulog_reads(data):
    agrees(data)


@pytest.mark.parametrize("old", [False, True])
def test_a_quadrotor_is_read_as_it_was_written(tmp_path, old):
    (record,) = read(tmp_path, writers.quad(TIMES, RATES, MOMENT, old=old).data)
    assert (record.make, record.vehicle) == ("PX4", "quadrotor")
    assert record.moment.values == pytest.approx(MOMENT, abs=1e-6)
    assert record.moment.time - record.rates.time == pytest.approx(0.0005, abs=1e-6)
    assert record.attitude.values[0] == pytest.approx([0.1, 0.0, 0.0], abs=1e-6)
    assert record.parameters["IMU_GYRO_CUTOFF"] == 40.0
    assert record.armed.at(np.array([0.1])).all()
    assert record.flying.at(np.array([0.1])).all()


def test_of_two_gyros_with_one_rate_the_one_that_the_link_shows_is_taken(tmp_path, data):
    (record,) = read(tmp_path, data)
    assert record.rates_filtered is False
    assert record.rates.values == pytest.approx(1.01 * RATES, rel=1e-6)
    assert record.remarks[0].startswith("rates from sensor_combined at 250 Hz, moment from vehicle_torque_setpoint")


def test_disarmed_it_says_so(tmp_path):
    (record,) = read(tmp_path, writers.quad(TIMES, RATES, MOMENT, armed=1).data)
    assert not record.armed.at(record.rates.time).any()


def test_a_plane_says_so(tmp_path):
    (record,) = read(tmp_path, writers.quad(TIMES, RATES, MOMENT, system_type=1).data)
    assert record.vehicle == "plane"


def test_a_vtol_that_flies_as_a_plane_is_not_in_hover(tmp_path):
    log = writers.quad(TIMES, RATES, MOMENT, system_type=20)
    log.write("vehicle_status", round(1e6 * TIMES[0]) + 1_000_000, 2, 20, 2)
    (record,) = read(tmp_path, log.data)
    assert record.vehicle == "vtol quadrotor"
    assert record.flying.at(np.array([0.9, 1.1])).tolist() == [True, False]
    assert any("flies as a plane for a while" in line for line in record.remarks)


def test_stamps_out_of_order_are_put_in_order_and_doubles_dropped(tmp_path):
    order = [*range(100), 101, 100, *range(102, 200), 199, *range(200, 500)]
    (record,) = read(tmp_path, writers.quad(TIMES[order], RATES[order], MOMENT[order]).data)
    assert record.moment.values == pytest.approx(MOMENT, abs=1e-6)
    assert "rates: stamps go back 1 times: put in order" in record.remarks
    assert "rates: 1 sample with the stamp of another: dropped" in record.remarks


def test_a_stamp_far_off_does_not_stretch_the_record(tmp_path):
    times = TIMES.copy()
    times[250] += 1174.0
    (record,) = read(tmp_path, writers.quad(times, RATES, MOMENT).data)
    assert record.rates.time[-1] == pytest.approx(TIMES[-1] - TIMES[0], abs=1e-5)
    assert len(record.rates.time) == len(TIMES) - 1
    assert "rates: 1 sample with a stamp far from the rest: dropped" in record.remarks


def test_a_hole_stays_one(tmp_path):
    there = np.abs(TIMES - 11.0) > 0.15
    (record,) = read(tmp_path, writers.quad(TIMES[there], RATES[there], MOMENT[there]).data)
    assert np.diff(record.rates.time).max() == pytest.approx(0.304, abs=0.01)
    assert any(line.startswith("rates: 1 hole of up to 0.30") for line in record.remarks)


@pytest.mark.parametrize("jump_s", [-7.0, 1e6])
def test_a_clock_that_is_set_anew_gives_two_records(tmp_path, jump_s):
    times = TIMES + jump_s * (np.arange(500) >= 300)
    first, second = read(tmp_path, writers.quad(times, RATES, MOMENT).data)
    assert (len(first.rates.time), len(second.rates.time)) == (300, 200)
    assert second.rates.time[-1] == pytest.approx(199 * 0.004, abs=1e-5)
    assert "part 2 of 2: the clock begins anew" in second.remarks


def test_a_log_rewritten_topic_by_topic_is_one_record(tmp_path):
    log = writers.ULog()
    log.declare("vehicle_torque_setpoint", "uint64_t timestamp;float[3] xyz;")
    log.declare("sensor_combined", "uint64_t timestamp;float[3] gyro_rad;")
    for topic, values in (("vehicle_torque_setpoint", MOMENT), ("sensor_combined", RATES)):
        for time, row in zip(TIMES, values, strict=True):
            log.write(topic, round(1e6 * time), *row)
    (record,) = read(tmp_path, log.data)
    assert record.rates.values == pytest.approx(RATES, rel=1e-6)
    assert record.moment.values == pytest.approx(MOMENT, rel=1e-6)
    assert any("written topic by topic" in line for line in record.remarks)


def test_an_appended_part_is_read_as_well():
    log = writers.ULog(flags=bytes(40))
    log.declare("vehicle_angular_velocity", "uint64_t timestamp;float[3] xyz;")
    for k in range(50):
        log.write("vehicle_angular_velocity", 4000 * k, *RATES[k])
    whole = len(log.data)
    cut = whole - 5  # in the middle of a message, as when a crash ended it
    for k in range(50, 80):
        log.write("vehicle_angular_velocity", 4000 * k, *RATES[k])
    flags = bytes(8) + bytes((1, *bytes(7))) + struct.pack("<3Q", cut, 0, 0)
    data = log.data[:19] + flags + log.data[59:cut] + log.data[whole:]
    stamps = ULog(data).table("vehicle_angular_velocity").column("timestamp") / 4000
    assert stamps.tolist() == [*range(49), *range(50, 80)]


def test_damage_within_costs_what_stands_before_the_next_mark():
    log = writers.ULog()
    log.declare("vehicle_angular_velocity", "uint64_t timestamp;float[3] xyz;")
    for k in range(30):
        log.write("vehicle_angular_velocity", 4000 * k, *RATES[k])
        if k % 10 == 9:
            log.sync()
    at = log.data.index(struct.pack("<Q", 4000 * 15)) - 5
    damaged = ULog(log.data[:at] + bytes(12) + log.data[at + 12 :])
    stamps = damaged.table("vehicle_angular_velocity").column("timestamp") / 4000
    assert stamps.tolist() == [*range(15), *range(20, 30)]
    assert any("damaged bytes left out" in line for line in damaged.remarks)


def test_without_torque_the_moment_comes_from_the_motors(tmp_path):
    """What PX4's allocation makes of a moment comes out as that moment: a symmetric X, whose scaled mixer is ±1/√2."""
    log = writers.ULog()
    log.declare("sensor_combined", "uint64_t timestamp;float[3] gyro_rad;")
    log.declare("actuator_motors", "uint64_t timestamp;float[12] control;")
    log.setting("CA_ROTOR_COUNT", 4)
    spin = (0.05, 0.05, -0.05, -0.05)
    for k, (x, y) in enumerate([(1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)]):
        for name, value in (("PX", x), ("PY", y), ("KM", spin[k])):
            log.setting(f"CA_ROTOR{k}_{name}", value)
    mixer = np.array([(-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1)]) * np.array([2**-0.5, 2**-0.5, 1.0])
    for time, rate, torque in zip(TIMES, RATES, MOMENT, strict=True):
        log.write("sensor_combined", round(1e6 * time), *rate)
        log.write("actuator_motors", round(1e6 * time), *(0.5 + mixer @ torque), *[0.0] * 8)
    (record,) = read(tmp_path, log.data)
    assert record.moment.values == pytest.approx(MOMENT, abs=1e-6)
    assert any("moment unmixed from actuator_motors" in line for line in record.remarks)


@pytest.mark.parametrize("topic", ["actuator_outputs", "actuator_motors"])
def test_motors_that_a_mixer_file_drove_are_not_unmixed_and_the_line_names_the_airframe(tmp_path, topic):
    log = writers.ULog()
    log.declare("sensor_combined", "uint64_t timestamp;float[3] gyro_rad;")
    log.declare(topic, "uint64_t timestamp;float[12] control;")
    log.setting("SYS_AUTOSTART", 4001)
    for time, rate in zip(TIMES, RATES, strict=True):
        log.write("sensor_combined", round(1e6 * time), *rate)
        log.write(topic, round(1e6 * time), *[0.5] * 12)
    words = rf"{topic} is there, but no CA_ROTOR\*.* SYS_AUTOSTART 4001\): set SDLOG_PROFILE"
    with pytest.raises(LogError, match=words):
        read(tmp_path, log.data)


@pytest.mark.parametrize(
    ("topic", "words"),
    [("vehicle_attitude", "no vehicle_angular_velocity"), ("sensor_combined", "no vehicle_torque_setpoint")],
)
def test_what_is_missing_is_refused_with_the_parameter_that_records_it(tmp_path, topic, words):
    log = writers.ULog()
    log.declare(topic, "uint64_t timestamp;float[3] gyro_rad;")
    log.write(topic, 1, 0.0, 0.0, 0.0)
    with pytest.raises(LogError, match=rf"x\.ulg: {words}.*SDLOG_PROFILE"):
        read(tmp_path, log.data)


def test_two_logs_in_one_file_are_two_records(tmp_path, data):
    first, second = read(tmp_path, data + writers.quad(TIMES - 5.0, RATES[::-1], MOMENT).data)
    assert first.rates.values == pytest.approx(1.01 * RATES, rel=1e-6)
    assert second.rates.values == pytest.approx(1.01 * RATES[::-1], rel=1e-6)

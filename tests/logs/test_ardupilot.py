"""ArduPilot's logs, held against pymavlink's reader message by message, and units against what was written."""

import numpy as np
import pytest
from pymavlink.DFReader import DFReader_binary

from dob_companion.errors import LogError
from dob_companion.logs import read_log
from dob_companion.logs.dataflash import BinaryLog
from tests.logs import writers

TIMES, RATES, MOMENT = writers.some_flight()


def read(tmp_path, log, name="x.bin"):
    path = tmp_path / name
    path.write_bytes(log.data if hasattr(log, "data") else log)
    return read_log(path)


@pytest.fixture(scope="module")
def log():
    return writers.copter(TIMES, RATES, MOMENT)


def test_every_number_is_the_one_that_pymavlink_reads(tmp_path, log):
    path = tmp_path / "x.bin"
    path.write_bytes(log.data)
    ours, theirs = BinaryLog(log.data), {}
    reader = DFReader_binary(str(path))
    while (message := reader.recv_msg()) is not None:
        theirs.setdefault(message.get_type(), []).append(message)
    for name in ("RATE", "IMU", "EV", "PARM"):
        table = ours.table(name)
        assert len(table.place) == len(theirs[name])
        for column in set(table.names) - {"Name"}:
            assert np.array_equal(table.column(column), [getattr(m, column) for m in theirs[name]]), (name, column)
    assert ours.table("PARM").texts("Name") == [m.Name for m in theirs["PARM"]]


def test_a_copter_is_read_as_it_was_written(tmp_path, log):
    (record,) = read(tmp_path, log)
    assert (record.make, record.vehicle, record.rates_filtered) == ("ArduPilot", "quadrotor", True)
    assert record.rates.time == pytest.approx(TIMES - TIMES[0], abs=1e-6)
    assert record.rates.values == pytest.approx(RATES, abs=1e-6)
    assert record.rate_setpoint.values == pytest.approx(0.5 * RATES, abs=1e-6)
    assert record.moment.values == pytest.approx(MOMENT, abs=1e-6)
    assert record.parameters["INS_GYRO_FILTER"] == 20.0
    assert record.armed.at(np.array([0.1])).all()
    assert record.flying.at(np.array([0.1])).all()


@pytest.mark.parametrize(
    ("unit", "factor", "full", "columns"),
    [
        ("deg/s", 180.0 / np.pi, 1.0, writers.RATE),
        ("rad/s", 1.0, 1.0, writers.RATE),
        ("centidegrees/s", 18000.0 / np.pi, 5000.0, writers.OLD_RATE),
    ],
)
def test_rates_of_any_version_become_rad_per_s_by_the_imu(tmp_path, unit, factor, full, columns):
    moment = np.clip(MOMENT, -1.0, 1.0)
    log = writers.copter(TIMES, RATES, moment, rate_unit=factor, full=full, columns=columns)
    (record,) = read(tmp_path, log)
    assert record.rates.values == pytest.approx(RATES, rel=1e-5, abs=1e-6)
    assert record.moment.values == pytest.approx(moment, rel=1e-5, abs=1e-6)
    assert any(f"RATE is in {unit}, as IMU shows" in line for line in record.remarks)


def test_one_damaged_message_changes_no_unit(tmp_path):
    rates, moment = RATES.copy(), MOMENT.copy()
    rates[100], moment[200] = 1e20, 1e20
    (record,) = read(tmp_path, writers.copter(TIMES, rates, moment))
    assert "RATE is in deg/s, as IMU shows" in record.remarks
    assert record.rates.values == pytest.approx(np.delete(RATES, 100, axis=0), abs=1e-6)
    assert record.moment.values == pytest.approx(np.delete(MOMENT, 200, axis=0), abs=1e-6)


def test_a_table_of_units_that_is_wrong_is_not_believed(tmp_path):
    log = writers.copter(TIMES, RATES, MOMENT, rate_unit=1.0)
    log.units("RATE", "skk-kk-kk-")
    (record,) = read(tmp_path, log)
    assert record.rates.values == pytest.approx(RATES, abs=1e-6)
    assert any("and not in deg/s as the log's table of units has it" in line for line in record.remarks)


@pytest.mark.parametrize(("units", "scale"), [("skk-kk-kk-", 1.0), ("sEE-EE-EE-", 180.0 / np.pi)])
def test_without_an_imu_the_log_s_own_units_hold(tmp_path, units, scale):
    log = writers.copter(TIMES, RATES, MOMENT, imu=False)
    log.units("RATE", units)
    (record,) = read(tmp_path, log)
    assert record.rates.values == pytest.approx(scale * RATES, rel=1e-5, abs=1e-6)


def test_text_gives_what_binary_gives(tmp_path, log):
    path = tmp_path / "x.bin"
    path.write_bytes(log.data)
    (binary,) = read_log(path)
    (text,) = read(tmp_path, writers.as_text(str(path)).encode(), "x.log")
    assert np.allclose(text.rates.values, binary.rates.values, rtol=1e-6)
    assert np.allclose(text.moment.values, binary.moment.values, rtol=1e-6)
    assert (text.vehicle, text.parameters) == (binary.vehicle, binary.parameters)


def test_text_with_nan_loses_those_samples_and_says_how_many(tmp_path, log):
    path = tmp_path / "x.bin"
    path.write_bytes(log.data)
    lines = writers.as_text(str(path)).splitlines()
    at = [k for k, line in enumerate(lines) if line.startswith("RATE,")][100:103]
    for k in at:
        fields = lines[k].split(", ")
        lines[k] = ", ".join([*fields[:3], "nan", *fields[4:]])
    (record,) = read(tmp_path, "\n".join(lines).encode(), "x.log")
    assert len(record.rates.time) == len(TIMES) - 3
    assert "rates: 3 samples not finite: dropped" in record.remarks


def test_system_id_s_gyro_is_before_the_filter_and_its_waveform_is_what_was_injected(tmp_path, log):
    log = writers.copter(TIMES, RATES, MOMENT)
    log.declare("SIDS", "QBf", "TimeUS,Ax,Mag")
    log.declare("SIDD", "Qfffffffff", "TimeUS,Time,Targ,F,Gx,Gy,Gz,Ax,Ay,Az")
    log.write("SIDS", round(1e6 * TIMES[100]), 11, 0.1)
    for time, rate in zip(TIMES[100:300], RATES[100:300], strict=True):
        log.write("SIDD", round(1e6 * time), 0.0, 0.07, 1.0, *np.degrees(rate), 0.0, 0.0, 0.0)
    (record,) = read(tmp_path, log)
    assert record.rates_filtered is True
    assert "SIDD at 250 Hz" in record.remarks[0]
    injected = record.injected
    inside = (injected.time > 0.41) & (injected.time < 1.19)
    assert injected.values[inside] == pytest.approx(np.tile([0.0, 0.07, 0.0], (int(inside.sum()), 1)), abs=1e-6)
    assert not injected.values[injected.time < 0.39].any()
    assert not injected.values[injected.time > 1.25].any()


def test_system_id_of_one_axis_after_another_is_injected_in_each(tmp_path):
    log = writers.copter(TIMES, RATES, MOMENT)
    log.declare("SIDS", "QBf", "TimeUS,Ax,Mag")
    log.declare("SIDD", "Qff", "TimeUS,Time,Targ")
    for axis, begin in ((10, 50), (12, 200), (7, 350)):
        log.write("SIDS", round(1e6 * TIMES[begin]), axis, 0.1)
        for time in TIMES[begin : begin + 100]:
            log.write("SIDD", round(1e6 * time), 0.0, 0.07)
    (record,) = read(tmp_path, log)
    times = np.array([0.4, 1.0, 1.6])
    at = np.searchsorted(record.injected.time, times - 1e-6)
    assert record.injected.values[at] == pytest.approx(np.array([(0.07, 0, 0), (0, 0, 0.07), (0, 0, 0)]), abs=1e-6)
    assert any("SID_AXIS 7, which is not the mixer" in line for line in record.remarks)


def test_without_torque_the_moment_comes_from_the_motors(tmp_path):
    """What a quadrotor's mixer makes of a moment, by ArduPilot's rules written down again, comes out as that moment."""
    log = writers.copter(TIMES, RATES, MOMENT)
    plain = writers.DataFlash()
    plain.declare("MSG", "QZ", "TimeUS,Message")
    plain.declare("PARM", "QNf", "TimeUS,Name,Value")
    plain.declare("IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    plain.declare("RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4")
    plain.write("MSG", 1, b"ArduCopter V4.6.0")
    for name, value in ((b"FRAME_CLASS", 1.0), (b"FRAME_TYPE", 1.0), (b"MOT_THST_EXPO", 0.0)):
        plain.write("PARM", 1, name, value)
    for name, value in ((b"MOT_SPIN_MIN", 0.0), (b"MOT_SPIN_MAX", 1.0)):
        plain.write("PARM", 1, name, value)
    signs = np.array(
        [(-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1)]
    )  # front right, rear left, front left, rear right
    for time, rate, torque in zip(TIMES, RATES, MOMENT, strict=True):
        micros = round(1e6 * time)
        plain.write("IMU", micros, 0, *rate, 0.0, 0.0, 0.0)
        plain.write("RCOU", micros, *np.round(1000 + 1000 * (0.5 + 0.5 * signs @ torque)).astype(int).tolist())
    (record,) = read(tmp_path, plain)
    assert record.moment.values == pytest.approx(MOMENT, abs=1e-3)
    assert any("moment unmixed from RCOU by FRAME_CLASS 1, FRAME_TYPE 1" in line for line in record.remarks)
    assert len(read(tmp_path, log)) == 1


def test_a_log_without_rate_is_refused_with_the_parameters_that_record_it(tmp_path):
    log = writers.DataFlash()
    log.declare("IMU", "Qfff", "TimeUS,GyrX,GyrY,GyrZ")
    for k in range(100):
        log.write("IMU", 4000 * k, 0.0, 0.0, 0.0)
    with pytest.raises(LogError, match=r"x\.bin: no RATE in it, and so no moment: set LOG_BITMASK with bit 0"):
        read(tmp_path, log)


@pytest.mark.parametrize(
    ("firmware", "vehicle"), [("ArduRover V4.5.1", "rover"), ("ArduPlane V4.5.1", "plane"), ("Sub", "")]
)
def test_a_vehicle_that_is_no_copter_says_so(tmp_path, firmware, vehicle):
    (record,) = read(tmp_path, writers.copter(TIMES, RATES, MOMENT, firmware=firmware))
    assert record.vehicle == vehicle


def test_a_plane_with_lifting_rotors_is_a_vtol(tmp_path):
    log = writers.copter(TIMES, RATES, MOMENT, firmware="ArduPlane V4.5.1")
    log.write("PARM", 1, b"Q_ENABLE", 1.0)
    (record,) = read(tmp_path, log)
    assert record.vehicle == "vtol plane"


def test_a_quadplane_flies_for_us_only_in_modes_that_hover_with_its_lifting_rotors_on(tmp_path):
    log = writers.copter(TIMES, RATES, MOMENT, firmware="ArduPlane V4.5.1")
    log.write("PARM", 1, b"Q_ENABLE", 1.0)
    log.declare("MODE", "QMB", "TimeUS,Mode,ModeNum")
    log.declare("QTUN", "Qf", "TimeUS,ThO")
    begin = TIMES[0]
    qloiter, cruise, qhover = 19, 7, 18
    for seconds, mode in ((0.0, qloiter), (0.6, cruise), (1.2, qhover)):
        log.write("MODE", round(1e6 * (begin + seconds)), mode, mode)
    for seconds, throttle in ((0.0, 0.4), (1.2, 0.4), (1.6, 0.01)):
        log.write("QTUN", round(1e6 * (begin + seconds)), throttle)
    (record,) = read(tmp_path, log)
    at = np.array([0.3, 0.9, 1.4, 1.8])
    assert record.flying.at(at).tolist() == [True, False, True, False]
    assert any("QLOITER" in remark and "not flying" in remark for remark in record.remarks)


def test_a_clock_that_begins_anew_gives_two_records(tmp_path):
    again = [*range(500), *range(200)]
    times = np.concatenate((TIMES, TIMES[:200] - 5.0))
    log = writers.copter(times, RATES[again], MOMENT[again])
    first, second = read(tmp_path, log)
    assert (len(first.rates.time), len(second.rates.time)) == (500, 200)
    assert "part 2 of 2: the clock begins anew" in second.remarks


def test_two_logs_in_one_file_are_two_records_each_with_its_own_parameters(tmp_path):
    long = writers.some_flight(seconds=3.0)
    other = writers.copter(*long, rate_unit=1.0)
    other.write("PARM", 1, b"INS_GYRO_FILTER", 40.0)
    first, second = read(tmp_path, writers.copter(TIMES, RATES, MOMENT).data + other.data)
    assert second.rates.values == pytest.approx(long[1], abs=1e-6)
    assert (first.parameters["INS_GYRO_FILTER"], second.parameters["INS_GYRO_FILTER"]) == (20.0, 40.0)
    assert "log 2 of 2 in the file" in second.remarks

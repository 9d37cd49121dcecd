"""Real logs of others and flights of ours, where they lie beside the checkout (`../shared/data`)."""

import io
from pathlib import Path

import numpy as np
import pytest
from pymavlink.DFReader import DFReader_binary

from dob_companion.cli.main import main
from dob_companion.identification.identify import identify
from dob_companion.logs import read_log
from dob_companion.logs.dataflash import BinaryLog
from dob_companion.logs.mixer import ardupilot_factors, ardupilot_outputs, ardupilot_thrust, unmixed
from dob_companion.logs.ulog import ULog

_PLACES = [parent / "shared" / "data" for parent in Path(__file__).resolve().parents]
SHARED = next((place for place in _PLACES if place.is_dir()), None)
pytestmark = pytest.mark.skipif(SHARED is None, reason="no ../shared/data beside the checkout: real logs are not held")


def log(name):
    path = SHARED / "logs" / name
    if not path.exists():
        pytest.skip(f"no {name} in ../shared/data/logs")
    return path


def test_a_hexacopter_s_log_reads_as_pymavlink_reads_it():
    path = log("bols_ape.bin")
    (record,) = read_log(path)
    rate, reader = [], DFReader_binary(str(path))
    while (message := reader.recv_match(type="RATE")) is not None:
        rate.append(message)
    assert record.rates.values == pytest.approx(np.radians([(m.R, m.P, m.Y) for m in rate]), abs=1e-12)
    assert record.moment.values == pytest.approx(np.array([(m.ROut, m.POut, m.YOut) for m in rate]))
    assert record.rates.time == pytest.approx(1e-6 * (np.array([m.TimeUS for m in rate]) - rate[0].TimeUS))
    assert (record.vehicle, record.make, record.rates_filtered) == ("hexarotor", "ArduPilot", True)
    assert "RATE is in deg/s, as IMU shows" in record.remarks
    assert record.flying.at(np.array([0.0, 30.0, 75.0])).tolist() == [False, True, False]


def test_a_hexacopter_s_motors_unmixed_follow_the_moment_that_was_logged():
    """RCOU is logged a few milliseconds beside RATE, so the two do not agree at 10 Hz; sign, axis and size do."""
    data = BinaryLog(log("bols_ape.bin").read_bytes())
    settings = data.table("PARM")
    parameters = dict(zip(settings.texts("Name"), settings.column("Value"), strict=True))
    factors = ardupilot_factors(parameters)
    out, rate = data.table("RCOU"), data.table("RATE")
    columns = [f"C{output}" for output in ardupilot_outputs(parameters, len(factors))]
    thrust = ardupilot_thrust(np.column_stack([out.column(name) for name in columns]), parameters)
    hover = slice(100, 600)
    moment = unmixed(thrust, factors)[hover]
    logged = np.column_stack([rate.column(name) for name in ("ROut", "POut", "YOut")])[hover]
    for ours, theirs in zip(moment.T, logged.T, strict=True):
        assert np.corrcoef(ours, theirs)[0, 1] > 0.7
        assert 0.5 < np.std(ours) / np.std(theirs) < 1.5


@pytest.mark.parametrize("name", ["pyulog_sample", "pyulog_small", "pyulog_unordered"])
def test_every_number_of_a_px4_log_is_the_one_that_pyulog_reads(name):
    import pyulog

    data = log(f"{name}.ulg").read_bytes()
    ours, theirs = ULog(data), pyulog.ULog(io.BytesIO(data))
    for topic in theirs.data_list:
        table = ours.table(topic.name, topic.multi_id)
        columns = [column for column in table.names if column in topic.data]
        assert columns
        for column in columns:
            values = topic.data[column].astype(np.float64)
            assert np.array_equal(table.column(column), values, equal_nan=True), (topic.name, column)


def test_one_that_was_held_in_the_hand_says_that_it_is_disarmed():
    (record,) = read_log(log("pyulog_sample.ulg"))
    assert not record.armed.at(record.rates.time).any()
    why = identify(record).axes["roll"].why
    assert why.startswith("moment at 47.5 Hz is too slow")
    assert why.endswith(
        "PX4 SDLOG_PROFILE with high rate and system identification; besides, it was disarmed throughout"
    )
    assert record.remarks[0] == "rates from sensor_combined at 250 Hz, moment from actuator_controls_0 at 49.9 Hz"


def test_the_same_with_a_stamp_that_goes_back_is_the_same_record():
    (ordered,), (record,) = read_log(log("pyulog_sample.ulg")), read_log(log("pyulog_unordered.ulg"))
    assert np.array_equal(record.rates.values, ordered.rates.values)
    assert np.array_equal(record.moment.time, ordered.moment.time)
    assert np.array_equal(record.moment.values, ordered.moment.values)
    assert "moment: 1 sample with a stamp far from the rest: dropped" in record.remarks


def test_one_whose_span_reads_1174_s_lasts_six_and_a_half():
    (record,) = read_log(log("pyulog_small.ulg"))
    assert record.rates.time[-1] == pytest.approx(6.5, abs=0.01)
    assert record.vehicle.startswith("vtol")
    assert record.rates_filtered is True


def test_one_with_parts_appended_is_one_record_on_one_clock():
    (record,) = read_log(log("pyulog_appended_multiple.ulg"))
    assert record.moment.time[-1] == pytest.approx(9.54, abs=0.01)
    assert "3 parts are appended: read as well" in record.remarks
    assert not record.armed.at(record.rates.time).any()


@pytest.mark.parametrize(("name", "seconds"), [("ardupilot_lua_bridge", 25.0), ("ardupilot_ringing", 10.0)])
def test_flights_of_ours_are_read_whole(name, seconds):
    path = SHARED / "flights" / f"{name}.tlog"
    if not path.exists():
        pytest.skip(f"no {name}.tlog in ../shared/data/flights")
    (record,) = read_log(path)
    assert record.rates.time[-1] == pytest.approx(seconds, abs=0.1)
    assert len(record.rates.time) == pytest.approx(250 * seconds, rel=0.01)
    assert record.flying.at(record.rates.time[100:]).all()


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("bols_ape.bin", "gyro at 9.79 Hz is too slow for a design at 250 Hz"),
        ("pyulog_appended_multiple.ulg", "moment at 9.85 Hz is too slow"),
        ("pyulog_sample.ulg", "disarmed throughout"),
        ("pyulog_small.ulg", "never in flight"),
        ("pyulog_unordered.ulg", "disarmed throughout"),
    ],
)
def test_tune_refuses_each_in_one_line_and_leaves_no_design(name, why, tmp_path, capfd):
    assert main(["tune", "--log", str(log(name)), "-o", str(tmp_path / "out")]) == 1
    (line,) = capfd.readouterr().err.splitlines()
    assert why in line
    assert "Traceback" not in line
    left = {path.name for path in (tmp_path / "out").rglob("*")}
    assert not {"design.json", "spec.toml"} & left

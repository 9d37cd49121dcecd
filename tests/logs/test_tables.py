"""Tables of numbers: CSV and .npz."""

import gzip
import zipfile

import numpy as np
import pytest

from dob_companion.errors import InputError, LogError
from dob_companion.logs import read_log
from tests.logs import writers

TIMES, RATES, MOMENT = writers.some_flight(seconds=0.4)
AXES = ("roll", "pitch", "yaw")
NAMES = ["time_s", *(f"{axis}_rate" for axis in AXES), *(f"{axis}_moment" for axis in AXES)]
TABLE = np.column_stack((TIMES, RATES, MOMENT))


def text(rows=TABLE, names=NAMES):
    return "\n".join([",".join(names), *(",".join(map(repr, map(float, row))) for row in rows)]) + "\n"


def read(tmp_path, content, name="x.csv"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_log(path)


def test_a_csv_is_read_bit_for_bit(tmp_path):
    (record,) = read(tmp_path, text())
    assert np.array_equal(record.rates.values, RATES)
    assert np.array_equal(record.moment.values, MOMENT)
    assert np.array_equal(record.rates.time, TIMES - TIMES[0])
    assert record.rates_filtered is None
    assert record.injected is None


def test_an_npz_is_read_whatever_its_name(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, **dict(zip(NAMES, TABLE.T, strict=True)))
    (record,) = read_log(path.rename(tmp_path / "a.csv"))
    assert np.array_equal(record.rates.values, RATES)


def test_optional_columns_and_empty_cells(tmp_path):
    names = [*NAMES, *(f"{axis}_injected" for axis in AXES), "flying"]
    rows = text().splitlines()[1:]
    lines = [row + (",0.1,0,0,1" if k % 5 == 0 else ",,,,") for k, row in enumerate(rows)]
    (record,) = read(tmp_path, "\ufeff# by hand\n" + "\n".join([",".join(names), *lines]))
    assert record.injected.values.tolist() == [[0.1, 0.0, 0.0]] * 20
    assert record.flying.at(record.rates.time).all()
    assert len(record.rates.time) == len(TIMES)


def test_what_is_not_a_number_is_dropped_and_counted(tmp_path):
    table = TABLE.copy()
    table[7, 1:4] = np.nan
    table[9, 2] = np.nan
    (record,) = read(tmp_path, text(table))
    assert len(record.rates.time) == len(TIMES) - 2
    assert "rates: 2 samples not finite: dropped" in record.remarks


def test_a_value_that_cannot_be_is_dropped_and_named(tmp_path):
    table = TABLE.copy()
    table[7, 1], table[9, 4] = 1e30, -1e9
    (record,) = read(tmp_path, text(table))
    assert (len(record.rates.time), len(record.moment.time)) == (len(TIMES) - 1, len(TIMES) - 1)
    assert "rates: 1 of more than 100 rad/s, which cannot be: dropped" in record.remarks


def test_rates_in_degrees_are_refused(tmp_path):
    table = TABLE.copy()
    table[:, 1:4] *= 1000.0
    with pytest.raises(LogError, match=r"rates of \d+, expected rad/s of 100 at most: other units\?"):
        read(tmp_path, text(table))


def test_columns_may_stand_in_any_order(tmp_path):
    order = [5, 2, 0, 6, 1, 3, 4]
    (record,) = read(tmp_path, text(TABLE[:, order], [NAMES[k] for k in order]))
    assert np.array_equal(record.rates.values, RATES)
    assert np.array_equal(record.moment.values, MOMENT)


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path):
    (record,) = read(tmp_path, text()[:-30])
    assert len(record.rates.time) == len(TIMES) - 1
    assert "the last line is cut short: left out" in record.remarks


@pytest.mark.parametrize(
    "content",
    [
        text().replace("roll_rate", " Roll_Rate"),
        text().replace(",", "\t"),
        text().replace(",", ";").replace(".", ","),
        text().encode("utf-16"),
    ],
)
def test_a_table_as_other_programs_write_it_is_the_same_table(tmp_path, content):
    (record,) = read(tmp_path, content)
    assert np.array_equal(record.rates.values, RATES)
    assert np.array_equal(record.moment.values, MOMENT)


def test_what_is_packed_is_named_and_not_guessed_at(tmp_path):
    for name, packed in (("x.gz", gzip.compress(text().encode())), ("y.gz", gzip.compress(b"ULog\x01\x12\x35" * 9))):
        with pytest.raises(LogError, match="a log that is compressed: unpack it first"):
            read(tmp_path, packed, name)
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        archive.writestr("flight.csv", text())
    with pytest.raises(LogError, match=r"it holds flight\.csv: unpack it first"):
        read_log(tmp_path / "x.zip")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            text(np.column_stack((1e3 * TIMES, RATES, MOMENT))),
            "time_s goes on by 4 from line to line: expected seconds",
        ),
        (text(np.column_stack((0.0 * TIMES, RATES, MOMENT))), "time_s does not go on from line to line"),
        (text(np.column_stack((TIMES, np.nan * RATES, MOMENT))), r"holds 100 \(100 not finite\) samples of body rates"),
        (text(names=[*NAMES[:6], "roll_rate"]), "the column roll_rate stands in it twice"),
        ("timestamp,p,q,r,mx,my,mz\n1,2,3,4,5,6,7\n", "lacks the column time_s, roll_rate"),
        (text(TABLE[:, :6], NAMES[:6]), "lacks the column yaw_moment"),
        (text(names=[*NAMES[:6], "yaw_torque"]), "lacks the column yaw_moment"),
        (text().replace("\n", ",1\n", 3), "lacks|cells"),
        (text().replace(",", ",x", 9), "line|lacks"),
        ("time_s,a\n", "lacks the column roll_rate"),
        (text(TABLE[:3]), "holds 3 samples of body rates and 3 of moments, expected 16"),
        ("hello\n", "of no known kind, expected a PX4 .ulg"),
        (b"PK\x03\x04" + bytes(100), "not a whole .npz of numbers"),
        (b"", "an empty file"),
        (b"\x89PNG", "a picture, expected"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(tmp_path, content, words):
    with pytest.raises(LogError, match=words) as refused:
        read(tmp_path, content)
    assert str(refused.value).startswith(str(tmp_path / "x.csv"))
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_is_refused_in_one_line(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_log(tmp_path / "none.ulg")

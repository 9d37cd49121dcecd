"""flight.npz as bytes: what is read, and what is refused in one line."""

import numpy as np
import pytest

from dob_companion.errors import InputError
from dob_companion.report.trace import FlightTrace
from tests.report.material import arrays, npz


def test_a_trace_reads_back_what_was_written():
    trace = FlightTrace.from_bytes(npz())
    for name, value in arrays().items():
        np.testing.assert_array_equal(getattr(trace, name), value)
    assert trace.rows("off") == slice(0, 1500)
    assert trace.rows("on") == slice(2000, 3500)
    assert trace.seconds(trace.rows("on"))[[0, -1]] == pytest.approx([0.0, 5.996])


def test_a_trace_cannot_be_changed():
    trace = FlightTrace.from_bytes(npz())
    with pytest.raises(ValueError, match="read-only"):
        trace.gyro[0, 0] = 1.0


def _with(name: str, index: tuple[int, ...], value: float) -> dict[str, np.ndarray]:
    array = np.array(arrays()[name])
    array[index] = value
    return {name: array}


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"gyro": None}, "'gyro' is missing"),
        ({"gyro": np.zeros((3500, 2))}, r"gyro has shape \(3500, 2\), expected \(N, 3\)"),
        ({"age": np.zeros(17, np.int16)}, "age has 17 rows, expected 3500"),
        (_with("attitude_error", (5, 1), np.nan), "attitude_error holds a number that is not finite"),
        ({"stamp_us": np.zeros(3500, np.int64)}, "stamp_us: expected at least two stamps, each later"),
        ({"stamp_us": np.arange(3500.0)}, "stamp_us holds float64"),
        ({"window": np.ones(3500, np.int8)}, "window: expected samples of the on window"),
        ({"rate": np.array(["a"] * 3500).reshape(-1, 1).repeat(3, 1)}, "rate holds <U1"),
        ({"rate": np.array([None] * 3500)}, "not a flight trace"),
    ],
)
def test_an_unfit_array_is_named_in_one_line(changed, complaint):
    with pytest.raises(InputError, match=r"^some\.npz: .*" + complaint) as caught:
        FlightTrace.from_bytes(npz(**changed), "some.npz")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("raw", [b"", b"PK\x03\x04", b"\x93NUMPY\x01\x00", b"hello", npz()[:-400], b"\x80\x04N."])
def test_bytes_that_are_no_npz_are_refused(raw):
    with pytest.raises(InputError, match=r"^flight\.npz: "):
        FlightTrace.from_bytes(raw)


def test_a_lone_array_is_not_a_trace():
    import io

    out = io.BytesIO()
    np.save(out, np.zeros(3))
    with pytest.raises(InputError, match="not a flight trace"):
        FlightTrace.from_bytes(out.getvalue())

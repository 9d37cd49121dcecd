"""The .tlog beside a trace, read by the tools of others."""

import subprocess
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil
from pymavlink.dialects.v10 import common as mav1
from pymavlink.dialects.v20 import common as mav

from dob_companion.files.segments import segments_in
from dob_companion.files.tlog import Splitter, entry
from tests.recorder.flights import recorded


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    directory = tmp_path_factory.mktemp("flights")
    with recorded(directory) as plane:
        plane.active()
    return plane, segments_in(directory)[0].tlog


def test_pymavlink_reads_both_directions_in_order_with_unix_times(flight):
    plane, path = flight
    log = mavutil.mavlink_connection(str(path))
    read = []
    while (m := log.recv_match()) is not None:
        read.append(m)
    assert not [m for m in read if m.get_type() == "BAD_DATA"]
    assert [m.get_msgbuf() for m in read if m.get_srcComponent() == 191] == [m.get_msgbuf() for m in plane.said]
    gyro = [m for m in read if m.get_type() == "HIGHRES_IMU"]
    assert len(gyro) == plane.sample
    assert [m.time_usec for m in gyro] == sorted(m.time_usec for m in gyro)
    times = [m._timestamp for m in read]
    assert times == sorted(times)
    assert abs(times[0] - time.time()) < 3600.0
    assert times[-1] - times[0] == pytest.approx(plane.now, abs=0.02)


def test_mavlogdump_prints_it(flight):
    _, path = flight
    tool = Path(sys.executable).parent / "mavlogdump.py"
    done = subprocess.run(
        [sys.executable, tool, "--types", "STATUSTEXT", path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    assert "DOB ACTIVE" in done.stdout


def frames():
    out, old = mav.MAVLink(None, srcSystem=1, srcComponent=1), mav1.MAVLink(None)
    signed = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    signed.signing.secret_key, signed.signing.sign_outgoing = b"k" * 32, True
    beat = (2, 0, 128, 0, 4, 3)
    return [
        bytes(mav.MAVLink_heartbeat_message(*beat).pack(out)),
        bytes(mav1.MAVLink_heartbeat_message(*beat).pack(old)),
        bytes(mav.MAVLink_heartbeat_message(*beat).pack(signed)),
        bytes(mav.MAVLink_debug_vect_message(b"x", 1, 1.0, 2.0, 3.0).pack(out)),
    ]


@given(st.lists(st.integers(1, 60), max_size=20))
def test_a_stream_in_any_pieces_gives_the_same_frames(cuts):
    data, expected = b"".join(frames()), frames()
    splitter, found = Splitter(datagrams=False), []
    at = 0
    for cut in [*cuts, len(data)]:
        found += splitter.frames(data[at : at + cut])
        at += cut
    assert found == expected


def test_a_torn_datagram_does_not_swallow_the_next():
    splitter = Splitter(datagrams=True)
    first, *_, last = frames()
    assert list(splitter.frames(first[:9])) == []
    assert list(splitter.frames(b"\0noise" + last + first)) == [last, first]


def test_an_entry_is_a_big_endian_time_and_the_frame():
    assert entry(1.5, b"ab") == (1_500_000).to_bytes(8, "big") + b"ab"

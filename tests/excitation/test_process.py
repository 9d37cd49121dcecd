"""`dob-companion excite` as a process: against the simulated vehicle in lockstep, and where it must not begin."""

import contextlib
import json
import resource
import signal
import subprocess
import sys

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.cli.exciting import companions_heard
from dob_companion.doctor.listening import Listening
from dob_companion.errors import InputError
from dob_companion.files.tlog_writer import TlogWriter
from dob_companion.logs.tlog import read_tlog
from tests.cli.processes import PATIENCE_S, UdpVehicle, one_line, run_cli
from tests.clients.processes import process
from tests.ports import free_port


def test_the_simulated_vehicle_is_excited_and_what_acted_is_in_the_log(tmp_path):
    port, ground, out = free_port(), free_port(), tmp_path / "excited"
    links = ("--link", f"udpout:127.0.0.1:{port}", "--gcs", f"udpout:127.0.0.1:{ground}")
    with process("-m", "sitl", "--clock", "lockstep", *links):
        finished = run_cli(
            *("excite", "--link", f"udpin:127.0.0.1:{port}", "--axis", "pitch", "-o", out),
            *("--seconds", "3", "--band", "0.5", "30", "--json"),
        )
    assert finished.returncode == 0, finished.stderr
    told = json.loads(finished.stdout)
    assert told == json.loads((out / "excite.json").read_text())
    assert (told["schema"], told["outcome"], told["profile"]) == ("dob-companion/excitation/1", "complete", "sitl")
    (axis,) = told["axes"]
    assert (axis["axis"], axis["amplitude"], axis["complete"]) == ("pitch", 0.06, True)
    assert told["not_told"] == ["battery"]
    assert (told["delay"]["median_samples"], told["delay"]["p95_samples"]) == (1, 1)
    (record,) = read_tlog(out / "excite.tlog")
    injected = record.injected.values
    assert np.abs(injected[:, 1]).max() == pytest.approx(0.06 * axis["level"], rel=0.3)
    assert not injected[:, [0, 2]].any()
    assert np.count_nonzero(injected[:, 1]) == pytest.approx(750, abs=10)
    assert np.isfinite(record.rates.values).all()


def test_it_refuses_where_another_companion_is_heard(tmp_path):
    port, out = free_port(), tmp_path / "excited"
    command = ["excite", "--link", f"udpin:127.0.0.1:{port}", "-o", str(out), "--axis", "roll"]
    running = subprocess.Popen(
        [sys.executable, "-m", "dob_companion", *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    other = mav.MAVLink(None, srcSystem=1, srcComponent=191)
    with UdpVehicle(port) as vehicle, contextlib.suppress(ConnectionRefusedError):
        vehicle.meet()
        while running.poll() is None:
            vehicle.beat()
            other.seq = (other.seq + 1) % 256
            vehicle.send(mav.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), by=other)
            for message in vehicle.hear(0.1):
                if message.get_type() == "COMMAND_LONG":
                    vehicle.send(mav.MAVLink_command_ack_message(message.command, 0, 0, 0, 1, 191))
    _, err = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 1
    assert "another companion is on the link (1/191); expected none: stop `dob-companion run` first" in err
    assert not [m for m in vehicle.said if m.get_type() == "DEBUG_VECT"]
    assert list(out.iterdir()) == []


def test_whose_corrections_are_heard_is_a_companion_and_our_own_heartbeat_that_comes_back_is_none():
    listening = Listening(0.004, 1.0, None)
    vehicle, other = mav.MAVLink(None, srcSystem=1, srcComponent=1), mav.MAVLink(None, srcSystem=2, srcComponent=191)
    listening.receive(mav.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3).pack(vehicle), 0.0)
    listening.advance(0.0)
    for message in listening.bytes_to_send():
        listening.receive(message, 0.1)
    listening.receive(mav.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3).pack(other), 0.2)  # of another vehicle
    assert companions_heard(listening) == []
    listening.receive(mav.MAVLink_debug_vect_message(b"DOB_CORR", 1000, 0.0, 0.0, 0.0).pack(other), 0.3)
    assert companions_heard(listening) == ["2/191"]


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--band", "5", "2"), "band 5 to 2 Hz"),
        (("--amplitude", "pitch=0.9"), "--amplitude pitch: 0.9, expected a number above 0, 0.5 at most"),
        (("--seconds", "0"), "seconds 0: expected 2 to 600"),
    ],
)
def test_what_cannot_be_asked_for_is_named_and_nothing_is_left(options, named, tmp_path):
    finished = run_cli("excite", "-o", tmp_path / "excited", *options)
    assert finished.returncode == 2
    assert named in one_line(finished)
    assert not (tmp_path / "excited").exists()


def test_no_vehicle_within_the_time_leaves_no_log(tmp_path):
    finished = run_cli(
        "excite", "--link", f"udpin:127.0.0.1:{free_port()}", "-o", tmp_path / "excited", "--timeout", "0.2"
    )
    assert finished.returncode == 1
    assert "no autopilot was heard within 0.2 s" in one_line(finished)
    assert list((tmp_path / "excited").iterdir()) == []


def test_a_recording_is_not_replaced(tmp_path):
    (tmp_path / "excite.tlog").write_bytes(b"flown yesterday")
    with pytest.raises(InputError, match=r"excite\.tlog: exists; expected a directory without a recording"):
        TlogWriter(tmp_path / "excite.tlog", datagrams=True)
    assert (tmp_path / "excite.tlog").read_bytes() == b"flown yesterday"


def test_a_full_disk_is_said_and_holds_nobody(tmp_path):
    """A limit on the size of files stands for a disk that is full."""
    before, frame = resource.getrlimit(resource.RLIMIT_FSIZE), mav.MAVLink_ping_message(0, 0, 0, 0)
    data = bytes(frame.pack(mav.MAVLink(None, 1, 1)))
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with TlogWriter(tmp_path / "excite.tlog", datagrams=True) as writer:
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
            for _ in range(100):
                writer.heard(data, 1.0)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert writer.trouble.endswith("excite.tlog: cannot be written: File too large")
    writer.said(data, 2.0)
    assert (tmp_path / "excite.tlog").stat().st_size == 100

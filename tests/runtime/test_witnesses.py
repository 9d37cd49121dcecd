"""A mistake in a witness costs that witness and never the flight: the real loop, a real socket."""

import signal
import subprocess
import sys

import pytest

from dob_companion.companion import Event
from dob_companion.flightlog.witness import Witness
from dob_companion.runtime.witnesses import Witnesses
from tests.cli.processes import UdpVehicle, wait_for
from tests.ports import free_port


def test_a_witness_that_raises_in_flight_is_said_once_and_left_out_and_the_flight_ends_with_a_fade():
    port = free_port()
    with subprocess.Popen(
        [sys.executable, "-m", "tests.runtime.witnessed", str(port)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            wait_for(process.stdout, "serving")
            with UdpVehicle(port) as vehicle:
                vehicle.activate()
                assert vehicle.fly(50)[-1].x == pytest.approx(-0.2, abs=1e-3)
                process.send_signal(signal.SIGTERM)
                last = vehicle.last_correction(process)
            out, err = process.communicate()
        finally:
            if process.poll() is None:
                process.kill()
    assert (last.x, last.y, last.z) == (0.0, 0.0, 0.0)
    assert process.returncode == 0, err
    said = "Failing has failed and is left out, the flight goes on: ZeroDivisionError: a mistake of this program"
    assert out.count(said) == 1
    assert err.count(said) == 1  # it takes events, so it may have been the log
    assert "Traceback" not in err
    assert "told since it failed: 1" in out


class Deaf(Witness):
    """Cannot even hear of another's mistake."""

    def event(self, event):
        raise RuntimeError(event.text)


class Log(Witness):
    def __init__(self):
        self.texts = []

    def event(self, event):
        self.texts.append(event.text)


class Wordy(Witness):
    def turned(self, companion, now, took_s):  # noqa: ARG002
        raise OSError("no room")


def test_two_that_fail_one_over_the_other_are_each_said_once(capfd):
    log = Log()
    witnesses = Witnesses([Wordy(), Deaf(), log])
    for _ in range(3):
        assert witnesses.turned(None, 0.0, 0.0) == []
    witnesses.event(Event.info("on we go"))
    assert [text.split()[0] for text in log.texts] == ["Deaf", "Wordy", "on"]
    assert "Deaf has failed" in capfd.readouterr().err

"""A vehicle whose moments a script reads beside the rate controller, as ArduPilot's does."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.profiles.ardupilot import HALF_A_LOOP_US
from sitl.constants import DT
from sitl.flight import Flight
from sitl.result import verdicts
from sitl.scenario.spec import load
from sitl.wire.endpoint import COMPANION, GROUND, Endpoint
from sitl.wire.reading import LOOP_US, RATE_HZ, Reading
from tests.scenarios.designs import design_for
from tests.scenarios.memory import fly
from tests.sitl.bench import parser_of
from tests.sitl.wire import Wire

SCENARIO = """
title = "Hover in a disturbance, moments read by a script"
hover_altitude_m = 2.0
[gyro]
noise_dbw = -68.0
[disturbance]
bandwidth_hz = 1.0
peak_attitude_error_rad = { roll = 0.05, pitch = 0.04, yaw = 0.04 }
[windows]
lead_s = 1.0
length_s = 3.0
settle_s = 3.0
[[check]]
measure = "rms_ratio"
at_least = 3.0
[[check]]
measure = "state"
state = "ACTIVE"
at_least = 1.0
"""


@pytest.fixture(scope="module")
def samples():
    wire = Wire()
    kept = []
    for k in range(1000):
        wire.step()
        now = wire.flight.newest
        kept.append(now._replace(u_e=(0.001 * k, 0.0, 0.0), correction=(0.1 * (k % 3), 0.0, 0.0)))
    return kept


def test_it_reports_some_200_times_a_second_between_samples(samples):
    reading = Reading(1)
    told = [(s, reading.of(s)) for s in samples]
    read = [(s, r) for s, r in told if r is not None]
    assert len(read) == pytest.approx(len(samples) * RATE_HZ * DT, rel=0.05)
    ahead = np.array([s.stamp_us - r.stamp_us for s, r in read])
    assert ahead.min() >= 0
    assert ahead.max() < LOOP_US
    assert ahead.mean() == pytest.approx(HALF_A_LOOP_US, rel=0.1)


def test_what_it_reads_is_the_controllers_output_that_ends_and_the_correction_that_begins(samples):
    reading, before = Reading(1), None
    for s in samples:
        r = reading.of(s)
        if r is not None:
            assert r.u_e[0] == pytest.approx(before.u_e[0] - before.correction[0] + s.correction[0])
            assert r.correction == s.correction
        before = s


def test_it_is_an_ardupilot_on_the_companions_link_alone():
    endpoint = Endpoint(Flight(load("calm"), 1), moments="read")
    endpoint.advance(0.0)
    makes = {}
    for link in (COMPANION, GROUND):
        heard = parser_of().parse_buffer(b"".join(endpoint.bytes_to_send(link)))
        makes[link] = {message.autopilot for message in heard if message.get_type() == "HEARTBEAT"}
    assert makes == {COMPANION: {mav.MAV_AUTOPILOT_ARDUPILOTMEGA}, GROUND: {mav.MAV_AUTOPILOT_GENERIC}}


@pytest.mark.proof
def test_the_companion_stays_on_throughout_and_attenuates(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(SCENARIO)
    flight = fly(load(str(path)), design_for(1), scale=(0.012, 0.024, 0.0185), moments="read")
    failed = [each for each in verdicts(flight) if not each.passed]
    assert not failed

"""The two messages of every sample, and the corrections that come back."""

import math
import struct

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl.autopilot.vehicle import START_US
from sitl.constants import DT_US
from sitl.wire.endpoint import COMPANION, GROUND
from tests.sitl.bench import payload
from tests.sitl.wire import Wire, kinds

NAN = math.nan


@pytest.fixture
def wire() -> Wire:
    return Wire()


def test_a_sample_is_a_gyro_message_and_then_a_torque_message_of_the_same_time():
    wire = Wire(await_arming=False)
    for k in range(1, 1000):
        pair = [m for m in wire.step() if m.get_type() in ("HIGHRES_IMU", "ACTUATOR_CONTROL_TARGET")]
        assert kinds(pair) == ["HIGHRES_IMU", "ACTUATOR_CONTROL_TARGET"]
        assert pair[0].time_usec == pair[1].time_usec == START_US + k * DT_US
    sample = wire.flight.newest
    assert (pair[0].xgyro, pair[0].ygyro, pair[0].zgyro) == sample.gyro
    assert tuple(pair[1].controls[:3]) == sample.u_e
    assert pair[1].controls[3] == pytest.approx(sample.thrust)
    assert pair[1].group_mlx == 0
    assert any(sample.u_e)


def test_the_pair_of_a_sample_travels_as_one_datagram(wire):
    wire.endpoint.step()
    assert len(wire.endpoint.bytes_to_send(COMPANION)) == 1


def test_a_repeated_pair_has_the_same_payload(wire):
    wire.take_off()
    first = [payload(m) for m in wire.step() if m.get_type() in ("HIGHRES_IMU", "ACTUATOR_CONTROL_TARGET")]
    wire.endpoint.repeat()
    assert [payload(m) for m in wire.take(COMPANION)] == first


def test_a_correction_comes_back_in_the_torque_message_with_its_age():
    wire = Wire()
    wire.take_off()
    stamp = wire.flight.vehicle.now_us
    wire.correct(stamp, (0.25, -0.5, 0.125))
    first = next(m for m in wire.step() if m.get_type() == "ACTUATOR_CONTROL_TARGET")
    second = next(m for m in wire.step() if m.get_type() == "ACTUATOR_CONTROL_TARGET")
    assert first.controls[4:7] == second.controls[4:7] == [0.25, -0.5, 0.125]
    assert (first.controls[7], second.controls[7]) == (1.0, 2.0)


def test_before_any_answer_the_age_is_minus_one(wire):
    assert next(m for m in wire.step() if m.get_type() == "ACTUATOR_CONTROL_TARGET").controls[7] == -1.0


def test_the_other_carrier_of_a_correction_works_too():
    wire = Wire()
    wire.take_off()
    controls = [0.25, 0.5, -0.125, 0.9, 0.0, 0.0, 0.0, 0.0]
    stamp = wire.flight.vehicle.now_us
    wire.say(COMPANION, mavlink.MAVLink_set_actuator_control_target_message(stamp, 2, 1, 1, controls))
    assert wire.endpoint.newest_answered
    wire.step()
    assert wire.flight.newest.correction == (0.25, 0.5, -0.125)


def test_so_does_the_carrier_that_px4_needs():
    wire = Wire()
    wire.take_off()
    payload = struct.pack("<Q3f", wire.flight.vehicle.now_us, 0.25, 0.5, -0.125).ljust(128, b"\0")
    wire.say(COMPANION, mavlink.MAVLink_tunnel_message(1, 1, 53425, 20, payload))
    assert wire.endpoint.newest_answered
    wire.step()
    assert wire.flight.newest.correction == (0.25, 0.5, -0.125)


@pytest.mark.parametrize(
    "how", [{"name": b"OTHER"}, {"link": GROUND}, {"source": (1, 192)}, {"source": (2, 191)}], ids=str
)
def test_only_the_companion_of_this_vehicle_corrects_it(how):
    wire = Wire()
    wire.take_off()
    wire.correct(wire.flight.vehicle.now_us, (0.25, 0.25, 0.25), **how)
    assert not wire.endpoint.newest_answered
    wire.step()
    assert wire.flight.newest.correction == (0.0, 0.0, 0.0)


def test_an_ignored_answer_is_still_an_answer():
    wire = Wire()
    wire.take_off()
    wire.correct(wire.flight.vehicle.now_us, (NAN, 0.0, 0.0))
    assert wire.endpoint.newest_answered
    assert wire.endpoint.ignored == 1
    assert wire.flight.log.arrays()["answered"][-1]


def test_an_answer_to_an_older_sample_does_not_answer_the_newest(wire):
    old = wire.flight.vehicle.now_us
    wire.step()
    wire.correct(old, (0.0, 0.0, 0.0))
    assert not wire.endpoint.newest_answered
    assert wire.flight.log.arrays()["answered"].tolist() == [True, False]


@pytest.mark.parametrize("stamp", [0, 2**64 - 1, START_US + 1, START_US - DT_US])
def test_an_answer_to_no_sample_is_nobody_s(wire, stamp):
    wire.correct(stamp, (0.0, 0.0, 0.0))
    assert not wire.flight.log.arrays()["answered"].any()

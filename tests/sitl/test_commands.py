"""Commands and parameters of the vehicle."""

import math

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl.wire.endpoint import COMPANION, GROUND
from tests.sitl.bench import command
from tests.sitl.wire import ACCEPTED, REJECTED, Wire, kinds

NAN = math.nan


@pytest.fixture
def wire() -> Wire:
    return Wire()


def test_arm_take_off_land_and_disarm(wire):
    assert wire.result(mavlink.MAV_CMD_NAV_TAKEOFF) == REJECTED
    wire.take_off()
    assert wire.flight.vehicle.flying
    assert wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0) == REJECTED
    assert wire.flight.vehicle.armed
    assert wire.result(mavlink.MAV_CMD_NAV_LAND) == ACCEPTED
    for _ in range(3000):
        wire.step()
    assert not wire.flight.vehicle.armed
    assert wire.result(mavlink.MAV_CMD_NAV_LAND) == REJECTED
    assert wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0) == ACCEPTED


def test_motors_stop_in_flight_only_by_force(wire):
    wire.take_off()
    assert wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0) == ACCEPTED
    assert not wire.flight.vehicle.armed


@pytest.mark.parametrize(("asked", "altitude"), [(0.0, 2.0), (NAN, 2.0), (5.0, 5.0)])
def test_a_take_off_goes_to_the_altitude_asked_or_to_the_parameter_s(wire, asked, altitude):
    wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    assert wire.result(mavlink.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, asked) == ACCEPTED
    assert wire.flight.vehicle.target_altitude == altitude


@pytest.mark.parametrize("altitude", [0.5, 1e6])
def test_a_take_off_out_of_range_is_denied(wire, altitude):
    wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    assert wire.result(mavlink.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, altitude) == mavlink.MAV_RESULT_DENIED


@pytest.mark.parametrize("wish", [NAN, 2.0, -1.0])
def test_arming_is_one_and_disarming_zero_and_nothing_else(wire, wish):
    assert wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, wish) == mavlink.MAV_RESULT_DENIED


def test_an_unknown_command_is_acknowledged_as_unsupported(wire):
    assert wire.result(mavlink.MAV_CMD_DO_SET_SERVO, 1.0) == mavlink.MAV_RESULT_UNSUPPORTED


def test_a_command_int_is_a_command_too(wire):
    message = mavlink.MAVLink_command_int_message(1, 1, 0, 400, 0, 0, 1.0, 0.0, 0.0, 0.0, 0, 0, 0.0)
    assert kinds(wire.ask(message)) == ["COMMAND_ACK"]
    assert wire.flight.vehicle.armed


@pytest.mark.parametrize(
    ("number", "kind"),
    [(148, "AUTOPILOT_VERSION"), (31, "ATTITUDE_QUATERNION"), (242, "HOME_POSITION"), (105, "HIGHRES_IMU")],
)
def test_a_message_comes_on_request(wire, number, kind):
    assert kinds(wire.ask(command(mavlink.MAV_CMD_REQUEST_MESSAGE, float(number)))) == [kind, "COMMAND_ACK"]


@pytest.mark.parametrize("number", [9999.0, -3.0, NAN, math.inf])
def test_a_message_that_is_not_had_is_unsupported(wire, number):
    assert wire.result(mavlink.MAV_CMD_REQUEST_MESSAGE, number) == mavlink.MAV_RESULT_UNSUPPORTED


def test_the_ground_station_sets_the_interval_of_a_stream(wire):
    def heard_in_two_seconds(start: float) -> int:
        for i in range(1000):
            wire.endpoint.advance(start + i * 0.002)
        return kinds(wire.take(GROUND)).count("ATTITUDE_QUATERNION")

    assert heard_in_two_seconds(0.0) == 40
    assert wire.result(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 31.0, 100_000.0) == ACCEPTED
    assert heard_in_two_seconds(10.0) == 20
    assert wire.result(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 31.0, -1.0) == ACCEPTED
    assert heard_in_two_seconds(20.0) == 0
    assert wire.result(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 31.0, 0.0) == ACCEPTED
    assert heard_in_two_seconds(30.0) == 40
    assert wire.result(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 9999.0, 1e5) == mavlink.MAV_RESULT_DENIED
    interval = wire.ask(command(mavlink.MAV_CMD_GET_MESSAGE_INTERVAL, 31.0))[0]
    assert (interval.get_type(), interval.interval_us) == ("MESSAGE_INTERVAL", 50_000)


@pytest.mark.parametrize(
    ("interval", "result"), [(0.0, ACCEPTED), (4000.0, ACCEPTED), (8000.0, mavlink.MAV_RESULT_DENIED), (-1.0, 2)]
)
def test_the_pair_goes_to_the_companion_at_the_vehicle_s_rate_and_no_other(wire, interval, result):
    wire.say(COMPANION, command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 105.0, interval))
    assert [m.result for m in wire.take(COMPANION)] == [result]


def test_the_parameter_list_is_complete_and_all_real32(wire):
    values = wire.ask(mavlink.MAVLink_param_request_list_message(1, 1))
    assert [v.param_index for v in values] == list(range(values[0].param_count))
    assert {v.param_type for v in values} == {mavlink.MAV_PARAM_TYPE_REAL32}
    assert {"SIM_ATT_P", "MIS_TAKEOFF_ALT", "SYSID_THISMAV"} <= {v.param_id for v in values}


def test_a_parameter_is_read_by_name_and_by_index(wire):
    by_name = wire.ask(mavlink.MAVLink_param_request_read_message(1, 1, b"SIM_ATT_P", -1))
    by_index = wire.ask(mavlink.MAVLink_param_request_read_message(1, 1, b"", by_name[0].param_index))
    assert [m.param_value for m in by_name + by_index] == [6.5, 6.5]


def test_a_parameter_written_changes_the_vehicle_and_is_echoed(wire):
    echo = wire.ask(mavlink.MAVLink_param_set_message(1, 1, b"SIM_ATT_P", 5.0, 9))
    assert [m.param_value for m in echo] == [5.0]
    assert wire.flight.vehicle.attitude_gain == (5.0, 5.0, 5.0)
    wire.ask(mavlink.MAVLink_param_set_message(1, 1, b"MIS_TAKEOFF_ALT", 7.0, 9))
    wire.take_off()
    assert wire.flight.vehicle.target_altitude == 7.0


@pytest.mark.parametrize(
    ("name", "value", "error"),
    [
        (b"SIM_ATT_P", NAN, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        (b"SIM_ATT_P", 1e9, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        (b"SIM_RATE_HZ", 100.0, mavlink.MAV_PARAM_ERROR_READ_ONLY),
        (b"NO_SUCH", 1.0, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST),
        (b"\xff\xfe", 1.0, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST),
    ],
)
def test_a_bad_write_is_refused_and_changes_nothing(wire, name, value, error):
    answers = wire.ask(mavlink.MAVLink_param_set_message(1, 1, name, value, 9))
    assert answers[0].get_type() == "PARAM_ERROR"
    assert answers[0].error == error
    assert wire.flight.vehicle.attitude_gain == (6.5, 6.5, 6.5)


@pytest.mark.parametrize(("name", "index"), [(b"NO_SUCH", -1), (b"", 99)])
def test_reading_what_does_not_exist_is_an_error_only_when_the_vehicle_is_meant(wire, name, index):
    assert kinds(wire.ask(mavlink.MAVLink_param_request_read_message(1, 1, name, index))) == ["PARAM_ERROR"]
    assert wire.ask(mavlink.MAVLink_param_request_read_message(1, 0, name, index)) == []

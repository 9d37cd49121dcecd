"""MAV_CMD_* addressed to the vehicle: every one is answered by a COMMAND_ACK."""

from math import isfinite

from pymavlink.dialects.v20 import common as mavlink

from sitl.constants import DT_US
from sitl.flight import Flight
from sitl.wire.messages import BUILDERS
from sitl.wire.parameters import Parameters
from sitl.wire.port import Message, Port, source_of
from sitl.wire.streams import Streams

FORCE = 21196.0
"""Magic second parameter of MAV_CMD_COMPONENT_ARM_DISARM: stop the motors even in the air."""

OK = mavlink.MAV_RESULT_ACCEPTED
NOT_NOW = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
DENIED = mavlink.MAV_RESULT_DENIED
UNSUPPORTED = mavlink.MAV_RESULT_UNSUPPORTED

PAIR = (mavlink.MAVLINK_MSG_ID_HIGHRES_IMU, mavlink.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET)
"""The two messages of every sample; on the companion's link their rate is the vehicle's."""


class Commands:
    """Carries out commands for one vehicle."""

    def __init__(self, flight: Flight, parameters: Parameters, streams: dict[str, Streams], paired: str) -> None:
        self._flight, self._parameters, self._streams, self._paired = flight, parameters, streams, paired

    def receive(self, message: Message, port: Port) -> None:
        """Carry out a COMMAND_LONG or COMMAND_INT that came in on `port` and acknowledge it there."""
        command = message.command
        p1, p2 = message.param1, message.param2
        p7 = message.z if message.get_type() == "COMMAND_INT" else message.param7
        if command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            result = self._arm(p1, p2)
        elif command == mavlink.MAV_CMD_NAV_TAKEOFF:
            result = self._take_off(p7)
        elif command == mavlink.MAV_CMD_NAV_LAND:
            result = self._land()
        elif command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            result = self._set_interval(p1, p2, port)
        elif command == mavlink.MAV_CMD_GET_MESSAGE_INTERVAL:
            result = self._get_interval(p1, port)
        elif command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            result = self._request(p1, port)
        elif command == mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
            result = self._request(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, port)
        else:
            result = UNSUPPORTED
        port.send(mavlink.MAVLink_command_ack_message(command, result, 0, 0, *source_of(message)))

    def _arm(self, wish: float, force: float) -> int:
        vehicle = self._flight.vehicle
        if wish == 1.0:
            vehicle.arm()
        elif wish != 0.0:
            return int(DENIED)
        elif vehicle.flying and force != FORCE:
            return int(NOT_NOW)
        else:
            vehicle.disarm()
        self._flight.script.poll()
        return int(OK)

    def _take_off(self, altitude: float) -> int:
        """Altitude in metres above the ground; not given (0 or NaN) means the vehicle's own parameter."""
        vehicle = self._flight.vehicle
        if not vehicle.armed:
            return int(NOT_NOW)
        wanted = altitude if isfinite(altitude) and altitude > 0.0 else self._parameters.takeoff_altitude
        if not 1.0 <= wanted <= 100.0:
            return int(DENIED)
        vehicle.take_off(wanted)
        self._flight.script.poll()
        return int(OK)

    def _land(self) -> int:
        vehicle = self._flight.vehicle
        if not vehicle.flying:
            return int(NOT_NOW)
        vehicle.land()
        return int(OK)

    def _set_interval(self, message_id: float, interval_us: float, port: Port) -> int:
        number = _whole(message_id)
        if number not in BUILDERS or not isfinite(interval_us):
            return int(DENIED)
        if port.name == self._paired and number in PAIR:
            return int(OK if 0.0 <= interval_us <= DT_US else DENIED)
        self._streams[port.name].set_interval(number, interval_us)
        return int(OK)

    def _get_interval(self, message_id: float, port: Port) -> int:
        number = _whole(message_id)
        if number not in BUILDERS:
            return int(DENIED)
        if port.name == self._paired and number in PAIR:
            interval_us = DT_US
        else:
            seconds = self._streams[port.name].interval(number)
            interval_us = round(seconds * 1e6) if isfinite(seconds) else -1
        port.send(mavlink.MAVLink_message_interval_message(number, interval_us))
        return int(OK)

    def _request(self, message_id: float, port: Port) -> int:
        number, newest = _whole(message_id), self._flight.newest
        if number not in BUILDERS:
            return int(UNSUPPORTED)
        if newest is None:
            return int(NOT_NOW)
        port.send(BUILDERS[number](self._flight.vehicle, newest))
        return int(OK)


def _whole(number: float) -> int:
    """A message id that came as a float; −1 for what is no id."""
    return int(number) if isfinite(number) else -1

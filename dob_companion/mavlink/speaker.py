"""Intentions to bytes: everything that the companion says, as component 191 of the vehicle's system."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes
from dob_companion.mavlink.codec import AUTOPILOT, COMPANION, CORRECTION_GROUP, CORRECTION_NAME
from dob_companion.mavlink.facts import Axes3, CommandForUs, FileRequest, Input, Sender, TimesyncRequest, Watched
from dob_companion.mavlink.frame import write_frame
from dob_companion.mavlink.ftp import refusal
from dob_companion.mavlink.profiles import Profile
from dob_companion.mavlink.tunnel import PAYLOAD, PAYLOAD_TYPE

CORRECTION_MESSAGES = ("DEBUG_VECT", "SET_ACTUATOR_CONTROL_TARGET", "TUNNEL")
"""The carriers of a correction, by their MAVLink names; the first is the default."""

_CORRECTION_NAME = CORRECTION_NAME.encode()
_TUNNEL_SIZE = 128
_CARRIERS = frozenset(getattr(mav, f"MAVLINK_MSG_ID_{name}") for name in CORRECTION_MESSAGES)
_ONE_BYTE_UNKNOWN, _TEMPERATURE_UNKNOWN, _LINK_UNKNOWN = 255, 127, 0xFFFFFFFF


def is_correction(message: bytes) -> bool:
    """Whether a message of ours carries a correction, so that a newer such message makes it void."""
    return int.from_bytes(message[7:10], "little") in _CARRIERS


class Severity(IntEnum):
    """STATUSTEXT severities in use (RFC 5424)."""

    CRITICAL = 2
    WARNING = 4
    NOTICE = 5
    INFO = 6


class ParamRefusal(IntEnum):
    """Why a parameter request is refused: MAV_PARAM_ERROR."""

    DOES_NOT_EXIST = 1
    VALUE_OUT_OF_RANGE = 2
    READ_ONLY = 5


@dataclass(frozen=True, slots=True)
class ComputerLoad:
    """What ONBOARD_COMPUTER_STATUS tells about this computer; memory in MiB, uptime in ms."""

    uptime_ms: int = 0
    ram_usage_mib: int = 0
    ram_total_mib: int = 0


@dataclass(frozen=True, slots=True)
class StreamRequest:
    """A message wanted at an interval, by its MAVLink name for people and its number for the wire; and what it brings,
    where that is watched. `unasked`: watched only, since it comes without being asked for, at a rate of its own."""

    name: str
    message: int
    interval_us: int
    brings: Input | Watched | None = None
    command: int = mav.MAV_CMD_SET_MESSAGE_INTERVAL
    unasked: bool = False


def stream_requests(profile: Profile, dt: float, *, kill_switch: bool) -> tuple[StreamRequest, ...]:
    """What a profile needs for a design of sample time `dt`, s; RC channels where one of them is a kill switch."""
    return tuple(
        StreamRequest(
            stream.name,
            stream.message,
            stream.interval_us or round(1e6 * dt),
            stream.brings,
            unasked=stream.unasked,
        )
        for stream in profile.streams
        if kill_switch or stream.brings is not Input.RC_CHANNELS
    )


class Speaker:
    """Packs messages in order, numbered by one sequence. `system` follows the vehicle once it is known; `axes` are
    those in which it takes corrections."""

    def __init__(self, correction_message: str = CORRECTION_MESSAGES[0], axes: VehicleAxes = IN_HOVER) -> None:
        self._axes = axes
        self._out = mav.MAVLink(None, srcSystem=1, srcComponent=COMPANION)
        self.carry(correction_message)

    def carry(self, correction_message: str) -> None:
        """Which message carries corrections from now on."""
        self._carrier = correction_message

    @property
    def system(self) -> int:
        """The system id we speak for, and to."""
        return int(self._out.srcSystem)

    @system.setter
    def system(self, system: int) -> None:
        self._out.srcSystem = system

    def correction(self, stamp_us: int, correction: Axes3) -> bytes:
        """The answer to the gyro sample of `stamp_us`: moment to add, hover axes, normalized torque."""
        x, y, z = self._axes.outward(correction)
        if self._carrier == "DEBUG_VECT":
            return self._write(mav.MAVLink_debug_vect_message, stamp_us, x, y, z, _CORRECTION_NAME)
        if self._carrier == "TUNNEL":
            payload = PAYLOAD.pack(stamp_us, x, y, z).ljust(_TUNNEL_SIZE, b"\0")
            about = (PAYLOAD_TYPE, self.system, AUTOPILOT, PAYLOAD.size)
            return self._write(mav.MAVLink_tunnel_message, *about, *payload)
        controls = (x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0)
        return self._pack(
            mav.MAVLink_set_actuator_control_target_message(
                stamp_us, CORRECTION_GROUP, self.system, AUTOPILOT, controls
            )
        )

    def heartbeat(self, fault: bool) -> bytes:
        """We are here; CRITICAL while a fault is latched."""
        status = mav.MAV_STATE_CRITICAL if fault else mav.MAV_STATE_ACTIVE
        return self._pack(
            mav.MAVLink_heartbeat_message(
                mav.MAV_TYPE_ONBOARD_CONTROLLER, mav.MAV_AUTOPILOT_INVALID, 0, 0, status, mavlink_version=3
            )
        )

    def text(self, severity: Severity, text: str) -> bytes:
        """A STATUSTEXT; what does not fit into its 50 characters is cut."""
        return self._pack(mav.MAVLink_statustext_message(severity, text.encode("ascii", "replace")[:50]))

    def param_value(self, name: str, value: float, count: int, index: int) -> bytes:
        """One parameter of ours, always REAL32."""
        return self._pack(
            mav.MAVLink_param_value_message(name.encode(), value, mav.MAV_PARAM_TYPE_REAL32, count, index)
        )

    def param_error(self, to: Sender, name: str, index: int, refusal: ParamRefusal) -> bytes:
        """A refused parameter request, to whom asked; `index` -1 where the request went by name."""
        param_id = name.encode("ascii", "replace")[:16]
        return self._pack(mav.MAVLink_param_error_message(to.system, to.component, param_id, index, refusal))

    def read_parameter(self, name: str) -> bytes:
        """Ask the autopilot for a parameter of its own."""
        return self._pack(mav.MAVLink_param_request_read_message(self.system, AUTOPILOT, name.encode("ascii"), -1))

    def ask_version(self) -> bytes:
        """Ask the autopilot for AUTOPILOT_VERSION, once."""
        command, message = mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION
        return self._pack(mav.MAVLink_command_long_message(self.system, AUTOPILOT, command, 0, message, *[0.0] * 6))

    def request(self, stream: StreamRequest) -> bytes:
        """Ask the autopilot for a message at an interval."""
        return self._pack(
            mav.MAVLink_command_long_message(
                self.system, AUTOPILOT, stream.command, 0, stream.message, stream.interval_us, 0, 0, 0, 0, 0
            )
        )

    def unsupported(self, command: CommandForUs) -> bytes:
        """We take no commands: say so, so that nobody waits."""
        return self._pack(
            mav.MAVLink_command_ack_message(
                command.command,
                mav.MAV_RESULT_UNSUPPORTED,
                target_system=command.sender.system,
                target_component=command.sender.component,
            )
        )

    def ask_time(self, now_ns: int) -> bytes:
        """Our clock, to have it back with the vehicle's: the round trip."""
        return self._pack(mav.MAVLink_timesync_message(0, now_ns))

    def no_file(self, request: FileRequest) -> bytes:
        """We have no files: say so, so that nobody waits."""
        to, answer = request.sender, list(refusal(request.payload))
        return self._pack(mav.MAVLink_file_transfer_protocol_message(0, to.system, to.component, answer))

    def timesync(self, request: TimesyncRequest, now_ns: int) -> bytes:
        """Our clock beside the asker's."""
        return self._pack(mav.MAVLink_timesync_message(now_ns, request.ts1_ns))

    def computer_status(self, stamp_us: int, load: ComputerLoad) -> bytes:
        """ONBOARD_COMPUTER_STATUS; fields that we do not measure say so."""
        none4, none6 = (0,) * 4, (_LINK_UNKNOWN,) * 6
        return self._pack(
            mav.MAVLink_onboard_computer_status_message(
                stamp_us,
                load.uptime_ms,
                0,
                (_ONE_BYTE_UNKNOWN,) * 8,
                (_ONE_BYTE_UNKNOWN,) * 10,
                (_ONE_BYTE_UNKNOWN,) * 4,
                (_ONE_BYTE_UNKNOWN,) * 10,
                _TEMPERATURE_UNKNOWN,
                (_TEMPERATURE_UNKNOWN,) * 8,
                (-1,) * 4,
                load.ram_usage_mib,
                load.ram_total_mib,
                none4,
                (_LINK_UNKNOWN,) * 4,
                (_LINK_UNKNOWN,) * 4,
                none6,
                none6,
                none6,
                none6,
                none6,
            )
        )

    def telemetry(self, stamp_us: int, values: Sequence[float]) -> bytes:
        """DEBUG_FLOAT_ARRAY `DOB`: d_hat, correction, state, delay in samples, rate in Hz."""
        data = [*values, *([0.0] * (58 - len(values)))]
        return self._write(mav.MAVLink_debug_float_array_message, stamp_us, 0, b"DOB", *data)

    def _write(self, layout: Any, *fields: Any) -> bytes:
        data = write_frame(layout, self._out.seq, self._out.srcSystem, self._out.srcComponent, *fields)
        self._out.seq = (self._out.seq + 1) % 256
        return data

    def _pack(self, message: Any) -> bytes:
        data = bytes(message.pack(self._out))
        self._out.seq = (self._out.seq + 1) % 256
        return data

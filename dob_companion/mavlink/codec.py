"""Bytes from the link to facts. Garbage never raises: it is counted and dropped."""

import struct
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes
from dob_companion.mavlink.facts import (
    CommandAck,
    CommandForUs,
    CorrectionHeard,
    Fact,
    FileRequest,
    Heartbeat,
    Input,
    ParamRead,
    ParamWrite,
    Sender,
    TimesyncReply,
    TimesyncRequest,
)
from dob_companion.mavlink.frame import read_frame, single_frame, unpacked
from dob_companion.mavlink.ftp import is_request
from dob_companion.mavlink.makes import make_of
from dob_companion.mavlink.outline import payload_of
from dob_companion.mavlink.parser import forget_parsed, robust_parser
from dob_companion.mavlink.profiles import FALLBACK, Profile
from dob_companion.mavlink.tunnel import correction_in

AUTOPILOT = mav.MAV_COMP_ID_AUTOPILOT1
COMPANION = mav.MAV_COMP_ID_ONBOARD_COMPUTER

CORRECTION_NAME = "DOB_CORR"
CORRECTION_GROUP = 2
"""How a correction is marked in DEBUG_VECT and in SET_ACTUATOR_CONTROL_TARGET."""

_INTEGER_FORMATS = {
    mav.MAV_PARAM_TYPE_UINT8: "<B3x",
    mav.MAV_PARAM_TYPE_INT8: "<b3x",
    mav.MAV_PARAM_TYPE_UINT16: "<H2x",
    mav.MAV_PARAM_TYPE_INT16: "<h2x",
    mav.MAV_PARAM_TYPE_UINT32: "<I",
    mav.MAV_PARAM_TYPE_INT32: "<i",
}


@dataclass(slots=True)
class WireCounters:
    """What came in and was not used."""

    bad: int = 0
    """pieces of garbage and wrong checksums; messages of other dialects are no fault"""
    foreign: int = 0
    """messages that only our vehicle's autopilot may send, from somebody else"""


class Codec:
    """Parses one link's bytes. Sensor data count only from the autopilot of `system`, once that is known.

    Until then (`system` is None) only heartbeats and parameter traffic get through; the companion learns the
    vehicle from its heartbeat and sets `system` and `profile`, whose readers read what that vehicle flies by.
    Facts are in hover axes; `axes` are those in which the vehicle speaks.
    """

    def __init__(
        self,
        system: int | None = None,
        *,
        profile: Profile = FALLBACK,
        datagrams: bool = True,
        axes: VehicleAxes = IN_HOVER,
    ) -> None:
        self.system = system
        self.profile = profile
        self.counters = WireCounters()
        self._datagrams = datagrams
        self._axes = None if axes == IN_HOVER else axes
        self._parser = robust_parser()

    def facts(self, data: bytes) -> Iterable[Fact]:
        """The facts in `data`: one datagram, or any piece of a byte stream."""
        facts = self._as_said(data)
        return facts if self._axes is None else map(self._axes.inward, facts)

    def _as_said(self, data: bytes) -> Iterable[Fact]:
        frame = read_frame(data, self.profile.layouts) if self._parser.buf_len() == 0 else None
        if frame is None:
            return self._parsed(data)
        fact = self._by_profile(*frame)
        return () if fact is None else (fact,)

    def may_bring_sample(self, data: bytes) -> bool:
        """Whether a gyro sample may be in `data`: False only where a look at its first bytes shows that it is not."""
        number = single_frame(data) if self._datagrams else None
        return number is None or number == self.profile.stream(Input.GYRO).message

    def _parsed(self, data: bytes) -> Iterator[Fact]:
        for message in self._messages(data):
            fact = self._read(message)
            if fact is not None:
                yield fact
        if self._datagrams and self._parser.buf_len() > 0:  # a torn message must not swallow the next datagram
            self._bad()
        forget_parsed(self._parser)

    def _read(self, message: Any) -> Fact | None:
        number = message.get_msgId()
        layout = self.profile.layouts.get(number)
        if layout is not None:
            fields = unpacked(layout, payload_of(bytes(message.get_msgbuf())))
            return self._by_profile(message.get_srcSystem(), message.get_srcComponent(), number, fields)
        read = _READERS.get(number)
        return read(self, message) if read else None

    def _by_profile(self, system: int, component: int, number: int, fields: tuple[Any, ...]) -> Fact | None:
        """What only our vehicle's autopilot may say, read as the profile says."""
        fact = self.profile.readers[number].fact(fields)
        if fact is None or (system == self.system and component == AUTOPILOT):
            return fact
        self.counters.foreign += 1
        return None

    def _messages(self, data: bytes) -> Iterator[Any]:
        while True:
            try:
                message = self._parser.parse_char(data)
            except (mav.MAVError, struct.error, ValueError, IndexError):  # robust parsing lets some of these through
                self._bad()
                return
            data = b""
            if message is None:
                return
            number = message.get_msgId()
            if number == mav.MAVLINK_MSG_ID_BAD_DATA:
                self.counters.bad += 1
            elif number != mav.MAVLINK_MSG_ID_UNKNOWN:  # of a dialect that the vehicle speaks besides
                yield message

    def _bad(self) -> None:
        self.counters.bad += 1
        self._parser = robust_parser()

    def from_autopilot(self, message: Any) -> bool:
        """Whether the message is our vehicle's autopilot speaking; counts it as foreign when it is not."""
        if message.get_srcSystem() == self.system and message.get_srcComponent() == AUTOPILOT:
            return True
        self.counters.foreign += 1
        return False

    def for_us(self, message: Any) -> bool:
        """Whether the message targets our component, or every component, of our system (or of any system)."""
        return message.target_system in (0, self.system) and message.target_component in (0, COMPANION)


def bytewise(m: Any) -> int | None:
    """The four bytes of a PARAM_SET's or PARAM_VALUE's value as the integer of its type; None for a real type."""
    layout = _INTEGER_FORMATS.get(m.param_type)
    return struct.unpack(layout, struct.pack("<f", m.param_value))[0] if layout else None


def _sender(message: Any) -> Sender:
    return Sender(message.get_srcSystem(), message.get_srcComponent())


def _heartbeat(_codec: Codec, m: Any) -> Fact | None:
    return Heartbeat(
        m.get_srcSystem(),
        m.get_srcComponent(),
        make=make_of(m),
        armed=bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED),
        status=m.system_status,
        simulated=bool(m.base_mode & mav.MAV_MODE_FLAG_HIL_ENABLED),
        mode=m.custom_mode,
    )


def _debug_vect(_codec: Codec, m: Any) -> Fact | None:
    return CorrectionHeard(_sender(m), m.time_usec, (m.x, m.y, m.z)) if m.name == CORRECTION_NAME else None


def _actuator_target(_codec: Codec, m: Any) -> Fact | None:
    c = m.controls
    return CorrectionHeard(_sender(m), m.time_usec, (c[0], c[1], c[2])) if m.group_mlx == CORRECTION_GROUP else None


def _tunnel(_codec: Codec, m: Any) -> Fact | None:
    found = correction_in(m)
    return CorrectionHeard(_sender(m), *found) if found else None


def _param_list(codec: Codec, m: Any) -> Fact | None:
    return ParamRead("", None, m.target_component == COMPANION, _sender(m)) if codec.for_us(m) else None


def _param_read(codec: Codec, m: Any) -> Fact | None:
    if not codec.for_us(m):
        return None
    index = m.param_index if m.param_index >= 0 else None
    return ParamRead("" if index is not None else m.param_id, index, m.target_component == COMPANION, _sender(m))


def _param_set(codec: Codec, m: Any) -> Fact | None:
    if not codec.for_us(m):
        return None
    return ParamWrite(m.param_id, m.param_value, bytewise(m), m.target_component == COMPANION, _sender(m))


def _command_ack(codec: Codec, m: Any) -> Fact | None:
    """IN_PROGRESS is neither yes nor no: the answer is still to come."""
    if not codec.for_us(m) or m.result == mav.MAV_RESULT_IN_PROGRESS or not codec.from_autopilot(m):
        return None
    return CommandAck(m.command, m.result == mav.MAV_RESULT_ACCEPTED, m.result)


def _command(codec: Codec, m: Any) -> Fact | None:
    if m.target_component != COMPANION or m.target_system != codec.system:
        return None
    return CommandForUs(m.command, _sender(m))


def _file_request(codec: Codec, m: Any) -> Fact | None:
    if m.target_component != COMPANION or m.target_system != codec.system:
        return None
    payload = bytes(m.payload)
    return FileRequest(payload, _sender(m)) if is_request(payload) else None


def _timesync(codec: Codec, m: Any) -> Fact | None:
    if not codec.from_autopilot(m):
        return None
    return TimesyncRequest(m.ts1) if m.tc1 == 0 else TimesyncReply(m.ts1)


_READERS: dict[int, Callable[[Codec, Any], Fact | None]] = {
    mav.MAVLINK_MSG_ID_HEARTBEAT: _heartbeat,
    mav.MAVLINK_MSG_ID_DEBUG_VECT: _debug_vect,
    mav.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET: _actuator_target,
    mav.MAVLINK_MSG_ID_TUNNEL: _tunnel,
    mav.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: _param_list,
    mav.MAVLINK_MSG_ID_PARAM_REQUEST_READ: _param_read,
    mav.MAVLINK_MSG_ID_PARAM_SET: _param_set,
    mav.MAVLINK_MSG_ID_COMMAND_ACK: _command_ack,
    mav.MAVLINK_MSG_ID_COMMAND_LONG: _command,
    mav.MAVLINK_MSG_ID_COMMAND_INT: _command,
    mav.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL: _file_request,
    mav.MAVLINK_MSG_ID_TIMESYNC: _timesync,
}

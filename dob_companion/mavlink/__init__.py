"""The only room that knows a MAVLink field: bytes to plain facts, and plain intentions to bytes. Pure."""

from dob_companion.mavlink.codec import Codec, WireCounters
from dob_companion.mavlink.facts import (
    AppliedMoment,
    CommandAck,
    CommandForUs,
    Fact,
    GyroSample,
    Heartbeat,
    ParamRead,
    ParamWrite,
    Sender,
    TimesyncRequest,
)
from dob_companion.mavlink.speaker import CORRECTION_MESSAGES, ComputerLoad, ParamRefusal, Severity, Speaker, StreamRequest, sitl_streams

__all__ = [
    "CORRECTION_MESSAGES",
    "AppliedMoment",
    "Codec",
    "CommandAck",
    "CommandForUs",
    "ComputerLoad",
    "Fact",
    "GyroSample",
    "Heartbeat",
    "ParamRead",
    "ParamRefusal",
    "ParamWrite",
    "Sender",
    "Severity",
    "Speaker",
    "StreamRequest",
    "TimesyncRequest",
    "WireCounters",
    "sitl_streams",
]

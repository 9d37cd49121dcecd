"""No files here: MAVLink FTP is refused at once, so that a ground station need not wait for a time-out.

MAVProxy asks for the parameters as a file first and falls back to the parameter protocol.
"""

import struct

from pymavlink.dialects.v20 import common as mavlink

from sitl.wire.port import Message, source_of

_HEADER = struct.Struct("<HBBBBBxI")  # sequence, session, opcode, size, request opcode, burst complete, offset
_NAK, _UNKNOWN_COMMAND = 129, 7


def refusal(message: Message) -> Message:
    """NAK to a FILE_TRANSFER_PROTOCOL request."""
    sequence, session, opcode, _, _, _, offset = _HEADER.unpack(bytes(message.payload[: _HEADER.size]))
    header = _HEADER.pack((sequence + 1) % 65536, session, _NAK, 1, opcode, 0, offset)
    content = list((header + bytes([_UNKNOWN_COMMAND])).ljust(251, b"\0"))
    return mavlink.MAVLink_file_transfer_protocol_message(0, *source_of(message), content)

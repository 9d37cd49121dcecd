"""No files here: MAVLink FTP is refused at once, so that a ground station need not wait for a time-out.

MAVProxy asks for the parameters as a file first, of every component, and takes up the parameter protocol when that is
refused; without an answer it waits for seconds.
"""

import struct

_HEADER = struct.Struct("<HBBBBBxI")
"""sequence, session, opcode, size, request opcode, burst complete, offset; then up to 239 bytes of data."""

PAYLOAD = 251
_ACK, _NAK, _UNKNOWN_COMMAND = 128, 129, 7


def is_request(payload: bytes) -> bool:
    """Whether it asks for something: what is an answer already gets none, or two refusals would answer one another."""
    return len(payload) >= _HEADER.size and payload[3] < _ACK


def refusal(request: bytes) -> bytes:
    """The payload that answers a request's: NAK, unknown command. The sequence number goes on by one."""
    sequence, session, opcode, _, _, _, offset = _HEADER.unpack_from(request)
    header = _HEADER.pack((sequence + 1) % 65536, session, _NAK, 1, opcode, 0, offset)
    return (header + bytes([_UNKNOWN_COMMAND])).ljust(PAYLOAD, b"\0")

"""Where a MAVLink frame begins and ends, whatever it says (https://mavlink.io/en/guide/serialization.html).

::

    MAVLink 1   FE size seq system component number(1)                          payload checksum(2)
    MAVLink 2   FD size incompatibility compatibility seq system component number(3)  payload checksum(2) signature(13)

The signature is there when bit 0 of the incompatibility flags is set.
"""

V1, V2 = 0xFE, 0xFD
SIGNED = 0x01
HEADER_V1, HEADER_V2, CHECKSUM, SIGNATURE = 6, 10, 2, 13
KNOWN_FROM = 3
"""So many bytes tell how long a frame is."""


def size_at(data: bytes, at: int) -> int:
    """Bytes of the frame that begins at `at`: 0 where none begins, KNOWN_FROM, more than there is, while unknown."""
    if data[at] not in (V1, V2):
        return 0
    if at + KNOWN_FROM > len(data):
        return KNOWN_FROM
    if data[at] == V1:
        return HEADER_V1 + data[at + 1] + CHECKSUM
    return HEADER_V2 + data[at + 1] + CHECKSUM + (SIGNATURE if data[at + 2] & SIGNED else 0)


def is_signed(frame: bytes) -> bool:
    """Whether a whole frame bears a signature, of whatever key."""
    return frame[0] == V2 and bool(frame[2] & SIGNED)


def number_of(frame: bytes) -> int:
    """Number of the message in a whole frame."""
    return frame[5] if frame[0] == V1 else frame[7] | frame[8] << 8 | frame[9] << 16


def payload_of(frame: bytes) -> bytes:
    """The payload of a whole frame."""
    begin = HEADER_V1 if frame[0] == V1 else HEADER_V2
    return frame[begin : begin + frame[1]]


def covered(frame: bytes) -> bytes:
    """What the checksum of a whole frame covers, but for the message's CRC_EXTRA."""
    return frame[1 : _end(frame) - CHECKSUM]


def checksum_of(frame: bytes) -> int:
    """The checksum that a whole frame bears."""
    end = _end(frame)
    return frame[end - 2] | frame[end - 1] << 8


def _end(frame: bytes) -> int:
    return len(frame) - (SIGNATURE if is_signed(frame) else 0)

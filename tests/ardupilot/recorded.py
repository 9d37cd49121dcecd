"""Pieces of telemetry logs in tests/data, recorded by `dob-companion run --record` beside ArduCopter's simulator."""

import os
import struct
from pathlib import Path

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import ardupilotmega as mav

DATA = Path(__file__).parents[1] / "data" / "ardupilot"
PIECES = {
    "copter_hello": "first contact: streams asked for, before take-off",
    "copter_enable": "hover in calm air, DOB_ENABLE written by a ground station through the autopilot",
    "copter_sine": "ACTIVE under a sine of 0.5 Hz and 6 rad/s² about roll",
}


def frames(piece, folder=DATA):
    """(arrival s, frame) in order, both directions."""
    data, at = (folder / f"{piece}.tlog").read_bytes(), 0
    while at < len(data):
        (micros,) = struct.unpack_from(">Q", data, at)
        signed = data[at + 10] & 1
        end = at + 8 + 12 + data[at + 9] + 13 * signed
        yield micros * 1e-6, data[at + 8 : end]
        at = end


def messages(piece, component=None, folder=DATA):
    """Decoded messages, of one component or of all."""
    parser = mav.MAVLink(None)
    for _, frame in frames(piece, folder):
        message = parser.decode(bytearray(frame))
        if component in (None, message.get_srcComponent()):
            yield message

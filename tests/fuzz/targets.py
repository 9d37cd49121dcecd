"""Everything that reads bytes or files, each as a function of bytes. What it must not do is raise: malformed input is
either counted, or one of the project's own errors in one line."""

import math
import struct
import tempfile
from pathlib import Path

from pymavlink.dialects.v20 import common as mav

from dob_companion.artifact import dumps, loads
from dob_companion.companion import Companion, parse_config
from dob_companion.companion.kept_parameters import dump_parameters, load_parameters
from dob_companion.errors import DobError
from dob_companion.files.playback import play_chunks
from dob_companion.files.trace import SCHEMA, Kind, frame, item, json_item, time_item
from dob_companion.flightlog.replay import Replay
from dob_companion.logs import reader_for
from dob_companion.mavlink import Codec
from dob_companion.synthesis.spec.parse import parse_spec
from sitl.flight import Flight
from sitl.scenario.spec import load
from sitl.wire.endpoint import COMPANION, GROUND, Endpoint
from tests.companion.aircraft import small_design
from tests.logs import writers

ROOT = Path(__file__).parents[2]
_DESIGN = small_design()
_SHORT = writers.some_flight(seconds=0.1)
_VEHICLE = mav.MAVLink(None, srcSystem=1, srcComponent=1)
_GROUND = mav.MAVLink(None, srcSystem=255, srcComponent=190)


def codec(data):
    """Facts of a datagram, and the same bytes as a stream in two pieces."""
    list(Codec(1).facts(data))
    stream = Codec(1, datagrams=False)
    cut = len(data) // 2
    list(stream.facts(data[:cut]))
    list(stream.facts(data[cut:]))


def companion(data):
    """A companion that injects gets any bytes; what it says stays finite and within 1."""
    fresh = Companion(_DESIGN, datagrams=len(data) % 2 == 0)
    fresh.receive(_heartbeat(), 0.0)
    for k, piece in enumerate(_pieces(data)):
        now = 0.004 * k
        fresh.receive(piece, now)
        fresh.advance(now)
        for said in fresh.bytes_to_send():
            if said[7:10] == b"\xfa\0\0":
                correction = struct.unpack_from("<fff", said, 18)
                assert all(math.isfinite(c) and abs(c) <= 1.0 for c in correction)
        fresh.events()
        fresh.next_deadline()


def design_file(data):
    """A design.json."""
    _refused(lambda: loads(_text(data), "design.json"))


def configuration(data):
    """A configuration of the daemon."""
    _refused(lambda: parse_config(_text(data), "dob.toml"))


def settings(data):
    """The operator's kept settings."""
    _refused(lambda: load_parameters(_text(data), "parameters.json"))


def spec(data):
    """A design spec."""
    _refused(lambda: parse_spec(_text(data), "spec.toml"))


def trace(data):
    """A recorded flight, replayed."""
    _refused(lambda: play_chunks([data], Replay(), "flight.dobtrace"))


def framed(data):
    """A recorded flight whose frames are whole and whose items are not."""
    head = frame([json_item(Kind.HEADER, _header())])
    _refused(lambda: play_chunks([head + frame([piece]) for piece in _pieces(data)], Replay(), "flight.dobtrace"))


def vehicle(data):
    """The simulated vehicle's end of both links."""
    endpoint = Endpoint(_flight())
    for k, piece in enumerate(_pieces(data)):
        link = (COMPANION, GROUND)[k % 2]
        endpoint.receive(link, piece)
        list(endpoint.bytes_to_send(link))
    endpoint.step()


def log(data):
    """A log or table of any kind, by the reader for it: what that does not foresee must not reach its last resort."""
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "log"
        path.write_bytes(data)
        _refused(lambda: reader_for(path)(path))


TARGETS = {
    f.__name__: f for f in (codec, companion, design_file, configuration, settings, spec, trace, framed, vehicle, log)
}


def seeds(name):
    """A few whole inputs to start from."""
    wire = [_heartbeat(), *_messages()]
    texts = {
        "design_file": [dumps(_DESIGN)[0].encode()],
        "configuration": [(ROOT / "deploy" / "dob-companion.toml").read_bytes()],
        "settings": [dump_parameters({"DOB_GAIN": 0.5}).encode()],
        "spec": [path.read_bytes() for path in sorted((ROOT / "examples").glob("*.toml"))],
        "trace": [frame([json_item(Kind.HEADER, _header())]) + frame([time_item(Kind.TIME, 1.0)])],
        "framed": [item(Kind.RECEIVED, _heartbeat()), json_item(Kind.CHECKPOINT, {"loop.shaper.f": 0.5})],
        "log": [writers.copter(*_SHORT).data, writers.quad(*_SHORT).data, b"time_s,roll_rate\n0.1,\n"],
    }
    return texts.get(name, [*wire, b"".join(bytes([len(m)]) + m for m in wire if len(m) < 256)])


def _refused(call):
    words = ""
    try:
        call()
    except DobError as problem:
        words = str(problem)
    assert "\n" not in words, words


def _text(data):
    return data.decode("utf-8", "replace")


def _pieces(data):
    """Pieces of at most 255 bytes, each after its length."""
    while data:
        yield data[1 : 1 + data[0]]
        data = data[1 + data[0] :]


def _heartbeat():
    return bytes(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3).pack(_VEHICLE))


def _messages():
    for message in (
        mav.MAVLink_highres_imu_message(4000, *[0.1] * 13, 63, 0),
        mav.MAVLink_actuator_control_target_message(4000, 0, [0.1] * 8),
        mav.MAVLink_extended_sys_state_message(3, 2),
        mav.MAVLink_timesync_message(0, 1),
        mav.MAVLink_debug_vect_message(b"DOB_CORR", 4000, 0.1, 0.1, 0.1),
        mav.MAVLink_command_ack_message(511, 0, target_system=1, target_component=191),
    ):
        yield bytes(message.pack(_VEHICLE))
    for message in (
        mav.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9),
        mav.MAVLink_param_request_read_message(1, 191, b"DOB_GAIN", -1),
        mav.MAVLink_param_request_list_message(1, 191),
        mav.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
    ):
        yield bytes(message.pack(_GROUND))


def _header():
    return {
        "schema": SCHEMA,
        "generator": "dob-companion",
        "machine": "any",
        "started": "2026-01-01T00:00:00Z",
        "unix_offset": 0.5,
        "flight": 1,
        "datagrams": True,
        "config": "",
        "design": dumps(_DESIGN)[0],
    }


def _flight():
    return Flight(load("calm"), 1, await_arming=True)

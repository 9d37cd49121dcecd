"""A small vehicle that says it is PX4 or ArduPilot and routes as an autopilot does: a process with two sockets.

    python -m tests.clients.vehicle {px4|ardupilot|generic} COMPANION_PORT GROUND_PORT [SIGNING_KEY]

It stands on the ground and sends the pair of each sample at 50 Hz, which is too slow to be flown by on purpose: these
tests are about parameters. What it has of its own is one integer parameter in its own encoding, so that a client which
follows the autopilot's encoding really does.
"""

import contextlib
import select
import socket
import struct
import sys
import time

from pymavlink.dialects.v20 import common as mav

KINDS = {
    "px4": (mav.MAV_AUTOPILOT_PX4, mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE),
    "generic": (mav.MAV_AUTOPILOT_GENERIC, mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST),
    "ardupilot": (mav.MAV_AUTOPILOT_ARDUPILOTMEGA, mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST),
}
FORWARDED = ("HEARTBEAT", "STATUSTEXT", "PARAM_VALUE", "PARAM_ERROR", "DEBUG_FLOAT_ARRAY", "ONBOARD_COMPUTER_STATUS")
OWN = b"SYSID_THISMAV"
PERIOD_S = 0.02


class Port:
    """A connected socket with a parser, a packer, and who was heard on it."""

    def __init__(self, port, key):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.socket.setblocking(False)
        self.heard = set()
        self.mav = mav.MAVLink(None, 1, 1)
        self.mav.robust_parsing = True
        if key:
            self.mav.signing.secret_key, self.mav.signing.sign_outgoing = key, True
            self.mav.signing.timestamp = round((time.time() - 1_420_070_400) * 1e5)

    def send(self, message):
        self.raw(message.pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256

    def raw(self, data):
        with contextlib.suppress(ConnectionRefusedError):  # the client is not there yet
            self.socket.send(data)

    def messages(self):
        try:
            found = self.mav.parse_buffer(self.socket.recv(65536)) or []
        except (ConnectionRefusedError, BlockingIOError):
            return
        for message in found:
            if message.get_msgId() >= 0:
                self.heard.add((message.get_srcSystem(), message.get_srcComponent()))
                yield message


class Vehicle:
    """Heartbeats, one parameter, samples, and routing between the two links."""

    def __init__(self, kind, companion, ground, key):
        self.autopilot, self.encoding = KINDS[kind]
        self.companion, self.ground = Port(companion, key), Port(ground, key)
        self.began = time.monotonic()

    def beat(self):
        for port in (self.companion, self.ground):
            port.send(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, self.autopilot, 81, 0, 3, 3))

    def sample(self):
        stamp = round(1e6 * (time.monotonic() - self.began)) + 1_000_000
        self.companion.send(mav.MAVLink_highres_imu_message(stamp, *[0.0] * 13, 63))
        if self.autopilot == mav.MAV_AUTOPILOT_PX4:
            none = [0.0] * 7 + [-1.0] + [0.0] * 50
            self.companion.send(mav.MAVLink_debug_float_array_message(stamp, b"DOB_ACT", 0, none))
        else:
            self.companion.send(mav.MAVLink_actuator_control_target_message(stamp, 0, [0.0] * 7 + [-1.0]))

    def take(self, port, other):
        for message in port.messages():
            name = message.get_type()
            target = getattr(message, "target_system", None), getattr(message, "target_component", 0)
            if name in FORWARDED or target in other.heard or (target[0] in (0, 1) and target[1] == 0):
                other.raw(bytes(message.get_msgbuf()))
            if target[0] in (0, 1) and target[1] in (0, 1):
                self.answer(port, name, message)

    def answer(self, port, name, message):
        if name in ("PARAM_REQUEST_LIST", "PARAM_REQUEST_READ", "PARAM_SET"):
            wanted = getattr(message, "param_id", "") or OWN.decode()
            if wanted == OWN.decode():
                port.send(mav.MAVLink_param_value_message(OWN, self.one(), mav.MAV_PARAM_TYPE_INT32, 1, 0))
        elif name == "COMMAND_LONG":
            known = message.command in (mav.MAV_CMD_REQUEST_MESSAGE, mav.MAV_CMD_SET_MESSAGE_INTERVAL)
            result = mav.MAV_RESULT_ACCEPTED if known else mav.MAV_RESULT_UNSUPPORTED
            sender = message.get_srcSystem(), message.get_srcComponent()
            port.send(mav.MAVLink_command_ack_message(message.command, result, 0, 0, *sender))
            if message.command == mav.MAV_CMD_REQUEST_MESSAGE and message.param1 == 148:
                flags = mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | self.encoding
                port.send(mav.MAVLink_autopilot_version_message(flags, 0, 0, 0, 0, *[[0] * 8] * 3, 0, 0, 1))

    def one(self):
        """The integer 1 as this autopilot writes it into a float field."""
        if self.encoding == mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST:
            return 1.0
        return struct.unpack("<f", struct.pack("<i", 1))[0]

    def fly(self):
        next_beat = next_sample = time.monotonic()
        pairs = {
            self.companion.socket: (self.companion, self.ground),
            self.ground.socket: (self.ground, self.companion),
        }
        while True:
            now = time.monotonic()
            if now >= next_beat:
                next_beat = now + 1.0
                self.beat()
            if now >= next_sample:
                next_sample = now + PERIOD_S
                self.sample()
            for ready in select.select(list(pairs), [], [], PERIOD_S / 4)[0]:
                self.take(*pairs[ready])


if __name__ == "__main__":
    kind, companion, ground, *key = sys.argv[1:]
    Vehicle(kind, int(companion), int(ground), bytes.fromhex("".join(key))).fly()

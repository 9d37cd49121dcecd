"""The simulated vehicle on its two links: MAVLink in, MAVLink out, forwarding in between. Pure.

Four verbs: `receive(link, data)`, `advance(now)`, `bytes_to_send(link)`, and `step()`, which flies one sample. Wall
time enters by `advance` only and serves heartbeats, the ground station's streams and repeated notices; the companion's
streams run on vehicle time.
"""

import struct
from math import inf, isfinite

from pymavlink.dialects.v20 import common as mavlink

from sitl.autopilot.correction import Verdict
from sitl.autopilot.vehicle import STICKS_US, Sample
from sitl.flight import Flight
from sitl.wire import ftp
from sitl.wire.commands import Commands
from sitl.wire.messages import BUILDERS, actuator_control_target, heartbeat, highres_imu
from sitl.wire.parameters import Parameters
from sitl.wire.port import COMPONENT, SYSTEM, Message, Port, source_of
from sitl.wire.reading import Reading
from sitl.wire.router import is_for_vehicle, passes
from sitl.wire.stamping import Stamping
from sitl.wire.streams import COMPANION_STREAMS, GROUND_STREAMS, Streams

COMPANION, GROUND = "companion", "ground"
OBSERVER = (SYSTEM, mavlink.MAV_COMP_ID_ONBOARD_COMPUTER)
"""Who may correct: component 191 of the vehicle's own system."""

HEARTBEAT_S = CALL_S = 1.0
_TUNNELLED = 53425
_ON_ITS_WAY = (Verdict.TAKEN, Verdict.HELD, Verdict.LOST)
DATAGRAM = 1200
"""Messages are joined into datagrams of at most this many bytes, so the pair of a sample travels as one."""


class Endpoint:
    """MAVLink side of one flight. `imu` is one of IMU_FRAMES: how the IMU that the companion hears is mounted;
    `moments` one of MOMENTS: who reports what acts, with "read" an ArduPilot on the companion's link."""

    def __init__(self, flight: Flight, imu: str = "hover", moments: str = "held") -> None:
        self.flight = flight
        self._imu = imu
        self._reading = Reading(flight.seed) if moments == "read" else None
        self.newest_answered = False
        self.ignored = 0
        self._ports = {COMPANION: Port(COMPANION), GROUND: Port(GROUND)}
        self._streams = {COMPANION: Streams(COMPANION_STREAMS), GROUND: Streams(GROUND_STREAMS)}
        self._parameters = Parameters(flight.vehicle, flight.scenario.hover_altitude, flight.seed)
        self._commands = Commands(flight, self._parameters, self._streams, COMPANION)
        self._stamping = Stamping(flight.scenario.clock, flight.seed)
        self._said: Sample | None = None
        self._called: str | None = None
        self._next_heartbeat = self._next_call = -inf

    @property
    def bad(self) -> int:
        """Pieces of garbage heard on both links."""
        return sum(port.bad for port in self._ports.values())

    def step(self) -> list[str]:
        """Fly the next sample and queue its pair; returns the script's notices. Raises FlightFailedError."""
        self._stream(COMPANION, self.flight.vehicle.now_us * 1e-6)
        sample, notices = self.flight.step()
        self.newest_answered = False
        self._said = self._stamping.stamped(sample)
        self._send_pair(self._said)
        for text in notices:
            self.notice(text)
        return notices

    def repeat(self) -> None:
        """Queue the newest pair again, unchanged: a sign of life while the clock stands."""
        if self._said is not None:
            self._send_pair(self._said)

    def _send_pair(self, sample: Sample) -> None:
        """A pair that the link loses is never sent, and nobody waits for its answer."""
        if self.flight.channel.pair_lost:
            self.newest_answered = True
            return
        port = self._ports[COMPANION]
        told = sample if self._reading is None else self._reading.of(sample)
        port.send(highres_imu(sample, self._imu))
        if told is not None:
            port.send(actuator_control_target(told))

    def notice(self, text: str) -> None:
        """Tell the ground station, as STATUSTEXT `sitl: …` (at most 50 bytes)."""
        raw = f"sitl: {text}".encode()[:50]
        self._ports[GROUND].send(mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_NOTICE, raw))

    def advance(self, now: float) -> None:
        """Queue what is due at wall time `now`, s: heartbeats, the ground station's streams, what is waited for."""
        if now >= self._next_heartbeat:
            self._next_heartbeat = now + HEARTBEAT_S
            for link, port in self._ports.items():  # whom a script reports to is ArduPilot's, whoever flies it
                scripted = self._reading is not None and link == COMPANION
                port.send(heartbeat(self.flight.vehicle, ardupilot=scripted))
        self._call(self.flight.script.awaiting, now)
        self._stream(GROUND, now)

    def _call(self, awaiting: str | None, now: float) -> None:
        """Say what is waited for, at once when it is new and again every second."""
        if awaiting != self._called or now >= self._next_call:
            self._called, self._next_call = awaiting, now + CALL_S
            if awaiting:
                self.notice(f"waiting for {awaiting}")

    def _stream(self, link: str, now: float) -> None:
        newest = self.flight.newest
        if newest is not None:
            for number in self._streams[link].due(now):
                self._ports[link].send(BUILDERS[number](self.flight.vehicle, newest))

    def bytes_to_send(self, link: str) -> list[bytes]:
        """Datagrams for `link`, whole messages each, oldest first."""
        messages = self._ports[link].take()
        if len(messages) < 2:
            return messages
        datagrams, size = [[messages[0]]], len(messages[0])
        for message in messages[1:]:
            size += len(message)
            if size > DATAGRAM:
                datagrams.append([])
                size = len(message)
            datagrams[-1].append(message)
        return [b"".join(d) for d in datagrams]

    def receive(self, link: str, data: bytes) -> None:
        """Take in bytes from `link`; garbage is counted. Raises FlightFailedError when the script is broken by them."""
        port = self._ports[link]
        other = self._ports[GROUND if link == COMPANION else COMPANION]
        for message in port.parse(data):
            kind = message.get_type()
            if kind == "DEBUG_VECT":
                if link == COMPANION and message.name == "DOB_CORR":
                    self._correct(message, message.time_usec, (message.x, message.y, message.z))
                continue
            if kind == "DEBUG_FLOAT_ARRAY" and link == COMPANION and message.name == "DOB":
                self._note_state(message)
            if passes(message, other.heard):
                other.forward(bytes(message.get_msgbuf()))
            self._handle(kind, message, link, port)

    def _handle(self, kind: str, message: Message, link: str, port: Port) -> None:
        if kind == "PARAM_VALUE":
            self._observe(message, link)
        elif kind == "TIMESYNC":
            if message.tc1 == 0:
                now_ns = self.flight.vehicle.now_us * 1000
                port.send(mavlink.MAVLink_timesync_message(now_ns, message.ts1))
        elif not is_for_vehicle(message, COMPONENT):
            return
        elif kind in ("COMMAND_LONG", "COMMAND_INT"):
            self._commands.receive(message, port)
        elif kind.startswith("PARAM_"):
            self._parameters.receive(message, port)
        elif kind == "RC_CHANNELS_OVERRIDE":
            self._override(message)
        elif kind == "MISSION_REQUEST_LIST":
            port.send(mavlink.MAVLink_mission_count_message(*source_of(message), 0))
        elif kind == "FILE_TRANSFER_PROTOCOL":
            port.send(ftp.refusal(message))
        elif kind == "SET_ACTUATOR_CONTROL_TARGET" and link == COMPANION and message.group_mlx == 2:
            x, y, z = message.controls[:3]
            self._correct(message, message.time_usec, (x, y, z))
        elif kind == "TUNNEL" and link == COMPANION and message.payload_type == _TUNNELLED:
            stamp_us, x, y, z = struct.unpack("<Q3f", bytes(message.payload[:20]))
            self._correct(message, stamp_us, (x, y, z))

    def _override(self, message: Message) -> None:
        """Move sticks and switches as a ground station does (MAVProxy's `rc 7 2000`)."""
        for i, at_rest in enumerate(STICKS_US):
            self._stick(i, getattr(message, f"chan{i + 1}_raw"), at_rest, ignored=(65535,) if i < 8 else (65535, 0))

    def _stick(self, channel: int, pulse_us: int, at_rest: int, *, ignored: tuple[int, ...]) -> None:
        """0 lets a channel go, 65535 leaves it as it is; beyond the eighth 0 and 65534 have these meanings."""
        if pulse_us not in ignored:
            self.flight.vehicle.pulses_us[channel] = at_rest if pulse_us in (0, 65534) else pulse_us

    def _correct(self, message: Message, stamp_us: int, value: tuple[float, float, float]) -> None:
        """An answer of the companion: taken up or ignored, it is an answer to the sample whose stamp it bears."""
        if source_of(message) != OBSERVER:
            return
        stamp_us = self._stamping.exact(stamp_us)
        if self.flight.answer(stamp_us, value) not in _ON_ITS_WAY:
            self.ignored += 1
        if stamp_us == self.flight.vehicle.now_us:
            self.newest_answered = True

    def _note_state(self, message: Message) -> None:
        """What the companion says of itself, for the record."""
        state = message.data[6]
        if source_of(message) == OBSERVER and isfinite(state):
            self.flight.log.state(self._stamping.exact(message.time_usec), int(state))

    def _observe(self, message: Message, link: str) -> None:
        if link == COMPANION and source_of(message) == OBSERVER and message.param_id == "DOB_ENABLE":
            self.flight.script.observer_reported(message.param_value == 1.0)

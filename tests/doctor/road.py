"""A vehicle and the way to it, in simulated time: what a doctor would hear with these faults."""

import heapq
import itertools
from dataclasses import dataclass, field

from pymavlink.dialects.v20 import common as mav

from dob_companion.doctor.diagnosis import diagnose
from dob_companion.doctor.listening import Listening, Stage
from dob_companion.doctor.settings import wanted
from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes
from tests.companion.aircraft import moment_array

DT = 0.004
UNSIGNED = None


@dataclass
class Road:
    """Runs a Listening to its end and keeps what it sent."""

    autopilot: int = mav.MAV_AUTOPILOT_GENERIC
    steps_us: tuple = (4000,)
    late_s: float = 0.0002
    drift: float = 0.0
    moments: bool = True
    skips: int = 0
    """Every so many samples no moment comes; 0: always one."""
    shift_us: int = 0
    moment_name: str = "ACTUATOR_CONTROL_TARGET"
    refuses: tuple = ()
    deaf: bool = False
    timesync: bool = True
    acks: int = 1
    result: int = 0
    others_ask: float = 0.0
    """How far the clock of others who ask the vehicle for its time on this link is from ours, s; 0: nobody does."""
    reflects: bool = False
    heartbeat: bool = True
    rates: object = None
    age: float = -1.0
    key: bytes = UNSIGNED
    gate: object = None
    extra: tuple = ()
    design: object = None
    profile: str = "auto"
    axes: VehicleAxes = IN_HOVER
    parameters: object = None
    """Of the autopilot, by name: read, if they are given, as doctor reads them."""
    version: int = 0
    sent: list = field(default_factory=list)

    def __post_init__(self):
        self.out = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        if self.key:
            self.out.signing.secret_key, self.out.signing.sign_outgoing = self.key, True
        self.ear = mav.MAVLink(None)
        self.queue, self.order = [], itertools.count()

    def at(self, when, message, by=None):
        heapq.heappush(self.queue, (when, next(self.order), bytes(message.pack(by or self.out))))

    def sample(self, now, stamp, k):
        rates = self.rates(k) if self.rates else (1e-3 * ((k * 7) % 5), 0.0, 0.0)
        moment = [0.1 * ((k * 3) % 4), 0, 0, 0.5, 0, 0, 0, self.age]
        self.at(now + self.late_s, mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, *rates, *[0] * 7, 56))
        if not self.moments or (self.skips and k % self.skips == 0):
            return
        if self.moment_name == "ACTUATOR_CONTROL_TARGET":
            self.at(now + self.late_s, mav.MAVLink_actuator_control_target_message(stamp + self.shift_us, 0, moment))
        elif self.moment_name == "DEBUG_FLOAT_ARRAY":
            self.at(now + self.late_s, moment_array(stamp + self.shift_us, moment[:3], age=self.age))
        else:
            self.at(now + self.late_s, mav.MAVLink_servo_output_raw_message(stamp, 0, *[1500] * 8))

    def listen(self, seconds=3.0):
        """The diagnosis, and the Listening behind it."""
        asking = {} if self.parameters is None else {"wanted": wanted}
        listening = Listening(
            DT, seconds, self.design, now=0.0, gate=self.gate, profile=self.profile, axes=self.axes, **asking
        )
        now, vehicle, k, next_beat = 0.0, 0.0, 0, 0.0
        while listening.stage is not Stage.DONE and now < 60.0:
            if self.heartbeat and now >= next_beat:
                next_beat = now + 1.0
                self.at(now, mav.MAVLink_heartbeat_message(2, self.autopilot, 0, 0, 3, 3))
                for by, message in self.extra:
                    self.at(now, message, by)
            if self.others_ask and round(now / 0.0005) % 100 == 0:
                theirs = round(1e9 * (now + self.others_ask))
                self.at(now + self.late_s, mav.MAVLink_timesync_message(round(1e9 * now) + 5, theirs))
            if self.heartbeat and now >= vehicle * (1.0 - self.drift):
                self.sample(now, 10_000_000 + round(1e6 * vehicle), k)
                vehicle += 1e-6 * self.steps_us[k % len(self.steps_us)]
                k += 1
            while self.queue and self.queue[0][0] <= now:
                listening.receive(heapq.heappop(self.queue)[2], now)
            listening.advance(now)
            for data in listening.bytes_to_send():
                if self.reflects:
                    heapq.heappush(self.queue, (now + 0.05, next(self.order), data))
                for message in self.ear.parse_buffer(data):
                    self.sent.append(message)
                    self.answer(message, now)
            now += 0.0005
        assert listening.stage is Stage.DONE
        return diagnose(listening, self.design), listening

    def answer(self, message, now):
        kind = message.get_type()
        if kind == "COMMAND_LONG" and not self.deaf:
            result = 2 if message.param1 in self.refuses else self.result
            for _ in range(self.acks):
                self.at(now + 2 * self.late_s, mav.MAVLink_command_ack_message(message.command, result, 0, 0, 1, 191))
        if kind == "COMMAND_LONG" and message.command == mav.MAV_CMD_REQUEST_MESSAGE and self.version:
            self.at(now, mav.MAVLink_autopilot_version_message(0, self.version, 0, 0, 0, *[[0] * 8] * 3, 0, 0, 0))
        if kind == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
            value = self.parameters[message.param_id]
            self.at(now + self.late_s, mav.MAVLink_param_value_message(message.param_id.encode(), value, 9, 900, 1))
        if kind == "TIMESYNC" and message.tc1 == 0 and self.timesync:
            self.at(now + 2 * self.late_s, mav.MAVLink_timesync_message(round(1e9 * now) + 5, message.ts1))

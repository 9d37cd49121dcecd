"""The sweep's side of the companion's link: MAVLink in, MAVLink out. Pure; it knows no socket and no clock.

It stands where a companion stands, as component 191, and answers each gyro sample. Its answers are the excitation in
place of a correction, so what is measured is the path that a correction takes. What acted comes back in
ACTUATOR_CONTROL_TARGET, stamped, so no delay of the link has to be known.

::

    ARM ─► TAKE_OFF ─► CLIMB ─► REST ─► EXCITE ─► REST … ─► LAND ─► SINK ─► DONE
"""

from enum import Enum
from math import isfinite
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from sitl.constants import DT_US
from sitl.errors import FlightFailedError
from sitl.sweep.multisine import Floats

REST = 1250
"""Samples of hover without excitation before each sweep: 5 s, longer than any transient of the rate loop."""

PATIENCE = 15_000
"""Samples, one minute, until a climb or a landing must have ended."""

RECORDED = ("u_e", "gyro", "correction")


class Phase(Enum):
    """Where the flight is."""

    ARM = "arm"
    TAKE_OFF = "take off"
    CLIMB = "climb"
    REST = "rest"
    EXCITE = "excite"
    LAND = "land"
    SINK = "sink"
    DONE = "done"


_COMMANDS = {
    Phase.ARM: (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, Phase.TAKE_OFF),
    Phase.TAKE_OFF: (mavlink.MAV_CMD_NAV_TAKEOFF, 0.0, Phase.CLIMB),
    Phase.LAND: (mavlink.MAV_CMD_NAV_LAND, 0.0, Phase.SINK),
}
"""What a phase asks of the vehicle: command, its first parameter, and the phase after the acknowledgement."""


class SweepClient:
    """Sweeps one axis after another: `signals` holds (axis index, excitation in normalized torque) in order.

    `records[i]` is then an array of shape (3, samples): that axis's u_e, gyro and correction while `signals[i]` ran.
    """

    def __init__(self, signals: list[tuple[int, Floats]]) -> None:
        self._signals = signals
        self.records: list[Floats] = []
        self.phase = Phase.ARM
        self._mav = mavlink.MAVLink(None, 1, mavlink.MAV_COMP_ID_ONBOARD_COMPUTER)
        self._mav.robust_parsing = True
        self._out: list[bytes] = []
        self._stamp: int | None = None
        self._gyro: tuple[float, float, float] | None = None
        self._answer = (0.0, 0.0, 0.0)
        self._record: list[tuple[float, float, float]] = []
        self._done = 0  # samples of the running phase
        self._landed_state = mavlink.MAV_LANDED_STATE_UNDEFINED

    @property
    def done(self) -> bool:
        """Swept and landed."""
        return self.phase is Phase.DONE

    def bytes_to_send(self) -> bytes:
        """Everything queued; empties the queue."""
        out, self._out = b"".join(self._out), []
        return out

    def receive(self, data: bytes) -> None:
        """Take in bytes of the vehicle. Raises FlightFailedError when the flight cannot be used or is refused."""
        for message in self._mav.parse_buffer(data) or ():
            kind = message.get_type()
            if message.get_srcComponent() != mavlink.MAV_COMP_ID_AUTOPILOT1:
                continue
            if kind == "HIGHRES_IMU":
                self._sample(message)
            elif kind == "ACTUATOR_CONTROL_TARGET" and message.time_usec == self._stamp:
                self._applied(message)
            elif kind == "COMMAND_ACK":
                self._acknowledged(message)
            elif kind == "EXTENDED_SYS_STATE":
                self._landed_state = message.landed_state
            elif kind == "HEARTBEAT":
                self._heard_heartbeat(message)

    def _heard_heartbeat(self, message: Any) -> None:
        """On the ground the vehicle disarms itself; in lockstep its clock may then stand, but not its heart."""
        if self.phase is Phase.SINK and not message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED:
            self._begin(Phase.DONE)

    def _sample(self, message: Any) -> None:
        stamp, last = message.time_usec, self._stamp
        if stamp != last:
            if self.phase is Phase.EXCITE and last is not None and stamp != last + DT_US:
                raise FlightFailedError(
                    f"a sample of {stamp} µs after {last} µs; expected {DT_US} µs more: fly in lockstep"
                )
            self._stamp, self._gyro = stamp, (message.xgyro, message.ygyro, message.zgyro)
            self._advance()
        self._command()
        self._send(mavlink.MAVLink_debug_vect_message(b"DOB_CORR", stamp, *self._answer))

    def _advance(self) -> None:
        """The next sample of the script, decided by phase; the answer goes out at once and acts a sample later."""
        self._done += 1
        self._answer = (0.0, 0.0, 0.0)
        if self._done % 250 == 1:
            kind, autopilot = mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID
            self._send(mavlink.MAVLink_heartbeat_message(kind, autopilot, 0, 0, mavlink.MAV_STATE_ACTIVE, 3))
        if self.phase is Phase.CLIMB:
            self._hurry()
            if self._landed_state == mavlink.MAV_LANDED_STATE_IN_AIR:
                self._begin(Phase.REST)
        elif self.phase is Phase.REST and self._done > REST:
            self._begin(Phase.EXCITE if len(self.records) < len(self._signals) else Phase.LAND)
        elif self.phase is Phase.SINK:
            self._hurry()
        if self.phase is Phase.EXCITE:
            self._excite()

    def _excite(self) -> None:
        axis, signal = self._signals[len(self.records)]
        if self._done < len(signal):
            answer = [0.0, 0.0, 0.0]
            answer[axis] = float(signal[self._done])
            self._answer = (answer[0], answer[1], answer[2])

    def _applied(self, message: Any) -> None:
        """u_e of the newest sample: with the gyro's reading it makes a row of the record."""
        if self.phase is not Phase.EXCITE or self._gyro is None or not self._done:
            return
        axis, signal = self._signals[len(self.records)]
        row = (message.controls[axis], self._gyro[axis], message.controls[4 + axis])
        if not all(map(isfinite, row)):
            raise FlightFailedError(f"sample {self._stamp} µs is not finite; expected {', '.join(RECORDED)} as numbers")
        if self._landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND:
            raise FlightFailedError("the vehicle came down during the sweep; expected it to hover")
        self._record.append(row)
        self._gyro = None  # a repeat of the pair is no new row
        if len(self._record) == len(signal):
            self.records.append(np.array(self._record).T)
            self._record = []
            self._begin(Phase.REST)

    def _hurry(self) -> None:
        if self._done > PATIENCE:
            raise FlightFailedError(f"{self.phase.value}: expected an end of it within {PATIENCE} samples of flight")

    def _begin(self, phase: Phase) -> None:
        self.phase, self._done = phase, 0

    def _command(self) -> None:
        """Say what the phase asks of the vehicle, once more with every sample until it is acknowledged."""
        if self.phase in _COMMANDS:
            command, p1, _ = _COMMANDS[self.phase]
            self._send(mavlink.MAVLink_command_long_message(1, 1, command, 0, p1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))

    def _acknowledged(self, ack: Any) -> None:
        """Only the answer to what the phase asks counts; it may come twice, or say first that it is being worked on."""
        asked = _COMMANDS.get(self.phase)
        ours = ack.target_component in (0, mavlink.MAV_COMP_ID_ONBOARD_COMPUTER)
        if asked is None or ack.command != asked[0] or not ours or ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            return
        if ack.result != mavlink.MAV_RESULT_ACCEPTED:
            name = mavlink.enums["MAV_RESULT"][ack.result].name
            raise FlightFailedError(f"{self.phase.value}: the vehicle answered {name}; expected MAV_RESULT_ACCEPTED")
        self._begin(asked[2])
        self._command()

    def _send(self, message: Any) -> None:
        self._out.append(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256

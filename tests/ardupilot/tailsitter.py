"""ArduPlane's tail-sitter in ArduPilot's own simulator: four motors and a wing, its IMU in the frame of forward flight.

Of its model nothing turns it from outside, as SIM_TWIST does a quadrotor. Here motors pull more or less than they are
told to (SIM_ENGINE_MUL): the right one for roll, the front one for pitch, both that turn counter-clockwise for yaw.
"""

import time
from contextlib import AbstractContextManager
from pathlib import Path
from typing import ClassVar

from pymavlink.dialects.v20 import ardupilotmega as mav

from tests.ardupilot.simulator import Ground, vehicle

OPTIONS = ("--config", str(Path(__file__).with_name("tailsitter.toml")))
"""Of the daemon's commands: in which axes it speaks."""

FIRST_MOTOR, LEAST_US = 5, 1000
SETTLED_S = 4.0
MOTORS = {0: (1,), 1: (3,), 2: (1, 2)}
SENSE = {0: -440.0, 1: 440.0, 2: 23.6}
"""Angular acceleration, rad/s², by as much as these motors' whole range, at its slope in hover: the torque that
the rate controller held against a step, times the rad/s² per unit that `tune --link` found. A tenth off, up or down."""


def tailsitter(
    program: Path, directory: Path, companion_port: str = "tcp:2", **more: float
) -> AbstractContextManager[None]:
    """ArduPlane's copter tail-sitter, as `vehicle`."""
    return vehicle(program, directory, "quadplane-copter_tailsitter", "tailsitter.parm", companion_port, more)


class PlaneGround(Ground):
    """A ground station for it. Attitudes are those of hover while it hovers, as ArduPlane streams them."""

    guided: ClassVar[int] = 15
    _disturbed = -1

    def fly(self, altitude_m: float = 60.0) -> None:
        """Arm in GUIDED, take off, wait until it hovers. From then on GUIDED means hover, also on the way back."""
        super().fly(altitude_m)
        self.set("Q_GUIDED_MODE", 1.0)

    @property
    def in_hover(self) -> bool:
        """A multicopter, by what it says itself."""
        return self._vtol_state == mav.MAV_VTOL_STATE_MC

    @property
    def on_its_wing(self) -> bool:
        """A plane, by what it says itself."""
        return self._vtol_state == mav.MAV_VTOL_STATE_FW

    @property
    def _vtol_state(self) -> int:
        told = self.newest.get("EXTENDED_SYS_STATE")
        return told.vtol_state if told else mav.MAV_VTOL_STATE_UNDEFINED

    def _let_be_disturbed(self) -> None:
        """What each motor is told in hover, µs above its least."""
        for message in (mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE):
            self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message, 100_000)
        self.set("SIM_ENGINE_MUL", 1.0)
        time.sleep(SETTLED_S)
        outputs = self.newest["SERVO_OUTPUT_RAW"]
        told = [getattr(outputs, f"servo{FIRST_MOTOR + i}_raw") - LEAST_US for i in range(4)]
        self._hover_us = sum(told) / len(told)

    def disturb(self, accelerations: dict[int, float]) -> None:
        """Turn it about one of these axes (0 roll, 1 pitch, 2 yaw), angular acceleration in rad/s²."""
        for axis, value in accelerations.items():
            if axis != self._disturbed and value:
                self._disturbed = axis
                self.write("SIM_ENGINE_FAIL", float(sum(1 << FIRST_MOTOR + motor - 2 for motor in MOTORS[axis])))
            if axis == self._disturbed:
                self.write("SIM_ENGINE_MUL", 1.0 + value / SENSE[axis] * 1000.0 / self._hover_us)

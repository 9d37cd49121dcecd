"""PX4's own simulator (SIH) with our module in it, and a ground station beside it. DOB_PX4 is the path of its bin/px4.

The build is px4_sitl with two modules from outside (EXTERNAL_MODULES_LOCATION): deploy/px4 and sih_disturbance beside
this file, which turns the aircraft where ArduPilot's simulator has SIM_TWIST. PX4 binds fixed ports and a socket in
/tmp, so all of this belongs into a network namespace of its own, one flight at a time.
"""

import contextlib
import math
import os
import shutil
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as mav

from tests.ardupilot.simulator import ATTITUDE_US, PRIORITY, Ground

GROUND, COMPANION_LINK = "udpin:127.0.0.1:14550", "udpin:127.0.0.1:14540"
PARAMETERS = {
    "DOBC_EN": 1,
    "DOBC_LIMIT": 0.3,
    "DOBC_LIMIT_Y": 0.3,
    "MIS_TAKEOFF_ALT": 10,
    "COM_RC_IN_MODE": 4,  # no pilot's sticks
    "NAV_DLL_ACT": 0,
    "COM_CPU_MAX": -1,  # a busy machine is no reason not to arm here
} | {f"PWM_MAIN_FUNC{motor}": 0 for motor in (1, 2, 3, 4)}  # sih_disturbance drives them
SENSE = {0: 160.0, 1: 160.0, 2: 13.33}
"""Angular acceleration, rad/s², when every motor is moved by all of its range in the sense of an axis: SIH_T_MAX 5 N,
SIH_L_ROLL and _PITCH 0.2 m, SIH_Q_MAX 0.1 Nm, SIH_IXX and _IYY 0.025, SIH_IZZ 0.03 kg m², four motors."""
SERVER = Path("/tmp/px4-sock-0")
"""Of PX4's instance 0, where its shell knocks."""
AUTO, LOITER, TAKEOFF = 4, 3, 2
AUX1 = 1 << 2
"""The extension of MANUAL_CONTROL that is AUX 1."""


class Sih:
    """A running PX4: its shell."""

    def __init__(self, program: Path, directory: Path) -> None:
        self.program, self.directory = program, directory

    def shell(self, module: str, *arguments: object) -> subprocess.CompletedProcess[str]:
        """A command of PX4's shell."""
        command = [self.program.with_name(f"px4-{module}"), *arguments]
        return subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, timeout=20)

    def wait(self) -> None:
        """Until the shell answers and the rate controller runs."""
        deadline = time.monotonic() + 60.0
        while "Startup script returned" not in self.log:
            if time.monotonic() > deadline:
                raise TimeoutError(f"PX4 has not started: {self.log[-500:]}")
            time.sleep(0.2)
        time.sleep(2.0)

    @property
    def log(self) -> str:
        """What it has printed."""
        return (self.directory / "simulator.log").read_text(errors="replace")

    def install(self) -> None:
        """What deploy/px4/extras.txt does at the start of a real one."""
        if self.shell("dob_correction", "start").returncode == 0:
            self.shell("mc_rate_control", "stop")
            self.shell("mc_rate_control", "start", "vtol")


def forget_the_dead(path: Path = SERVER) -> None:
    """Remove the socket of a PX4 that did not end in good order; one that lives keeps it."""
    if path.exists():
        with socket.socket(socket.AF_UNIX) as knocks:
            try:
                knocks.connect(str(path))
            except ConnectionRefusedError:
                path.unlink()


@contextlib.contextmanager
def sih(program: Path, directory: Path, **more: float) -> Iterator[Sih]:
    """A quadrotor in `directory`, its log there as simulator.log. `more` are further parameters."""
    shutil.rmtree(directory / "vehicle", ignore_errors=True)
    (directory / "vehicle").mkdir(parents=True)
    aircraft = {"PX4_SYS_AUTOSTART": "10040", "PX4_SIM_MODEL": "sihsim_quadx"}
    forget_the_dead()
    command = [program, "-d", "-w", directory / "vehicle", program.parents[1] / "etc"]
    with (directory / "simulator.log").open("w") as log:
        process = subprocess.Popen(
            [*map(str, command)], stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
            env=os.environ | aircraft,
        )  # fmt: skip
        with contextlib.suppress(PermissionError):  # an autopilot does not wait for other programs
            os.sched_setscheduler(process.pid, os.SCHED_RR, os.sched_param(PRIORITY))
        try:
            running = Sih(program, directory)
            running.wait()
            for name, value in (PARAMETERS | more).items():  # not by its environment: 1.15 takes none from there
                running.shell("param", "set", name, f"{value:g}")
            running.shell("sih_disturbance", "start")
            running.install()
            yield running
        finally:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


class Px4Ground(Ground):
    """The ground station, at PX4's port for one."""

    def __init__(self, log: Path) -> None:
        self.stick: int | None = None
        self._boot_s = 0.0
        super().__init__(log, GROUND)
        self._sticks = threading.Thread(target=self._hold_sticks, daemon=True)
        self._sticks.start()

    def _hold_sticks(self) -> None:
        """Sticks in the middle and AUX 1 at `stick`, ten times a second, unless that is None."""
        while self._open:
            if self.stick is not None:
                more = (0,) * 6
                self._link.mav.manual_control_send(1, 0, 0, 500, 0, 0, 0, AUX1, 0, 0, self.stick, *more[1:])
            time.sleep(0.1)

    def _take(self, message) -> None:
        """Attitudes are the simulator's truth, not the estimate, which its sensors' noise moves by 0.2°. PX4 sends the
        truth without a stamp: it bears the estimate's."""
        if message.get_type() == "HIL_STATE_QUATERNION":
            w, x, y, z = message.attitude_quaternion
            roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
            pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
            yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
            self.attitudes.append((message.time_usec * 1e-6 or self._boot_s, roll, pitch, yaw))
        elif message.get_type() == "ATTITUDE":
            self._boot_s = message.time_boot_ms * 1e-3
        else:
            super()._take(message)

    def disturb(self, accelerations: dict[int, float]) -> None:
        """Turn the vehicle about these axes, angular acceleration in rad/s²."""
        shares = [accelerations.get(axis, 0.0) / SENSE[axis] for axis in range(3)]
        self._link.mav.debug_vect_send(b"DOB_DIST", 0, *shares)

    def fly(self, altitude_m: float = 10.0) -> None:
        """Arm as soon as the vehicle can, take off, wait until it hovers."""
        self.wait("heartbeat", lambda: "HEARTBEAT" in self.newest)
        self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_HIL_STATE_QUATERNION, ATTITUDE_US)
        self.wait("take-off mode", lambda: self._sub_mode() == TAKEOFF, nudge=lambda: self._auto(TAKEOFF))
        self.wait("armed", self._armed, nudge=lambda: self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1))
        self.wait("altitude", lambda: abs(self.altitude - altitude_m) < 0.5)
        self.wait("hold", lambda: self._sub_mode() == LOITER, nudge=lambda: self._auto(LOITER))

    def _auto(self, sub_mode: int) -> None:
        self.command(mav.MAV_CMD_DO_SET_MODE, mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, AUTO, sub_mode)

    def _sub_mode(self) -> int:
        return self._mode() >> 24 if self._mode() > 0 else -1

"""ArduPilot's own simulator, with our script on board, and a ground station beside it.

The simulator binds every address of the machine, so all of this belongs into a network namespace of its own (see
`namespace`).
"""

import contextlib
import math
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import ClassVar

os.environ.setdefault("MAVLINK20", "1")
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mav

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
SCRIPT = ROOT / "deploy" / "ardupilot" / "dob_correction.lua"
GROUND, COMPANION_LINK = "tcp:127.0.0.1:5760", "tcp:127.0.0.1:5762"
HOME = "-35.363261,149.165230,584,0"
LARGEST_TWIST_MS = 2_000_000_000
ATTITUDE_US = 20_000
PATIENCE_S = 120.0
PRIORITY = 30
"""Real-time priority of a simulator where it may be had: a daemon, at 20, is on another computer than an autopilot."""
SCRIPT_PARAMETERS = {"DOBC_FRAME": 1, "DOBC_ENABLE": 1, "DOBC_LIMIT": 0.3}
"""A file of defaults does not reach what a script declares; so they are written, as a user does."""


def copter(
    program: Path, directory: Path, companion_port: str = "tcp:2", **more: float
) -> AbstractContextManager[None]:
    """ArduCopter's quadrotor, as `vehicle`."""
    return vehicle(program, directory, "+", "copter.parm", companion_port, more)


@contextlib.contextmanager
def vehicle(
    program: Path, directory: Path, model: str, parameters: str, companion_port: str, more: dict[str, float]
) -> Iterator[None]:
    """A simulated vehicle in `directory`, its log there as simulator.log; `parameters` is a file beside this one,
    `more` are further ones."""
    shutil.rmtree(directory / "logs", ignore_errors=True)
    (directory / "scripts").mkdir(parents=True, exist_ok=True)
    shutil.copy(SCRIPT, directory / "scripts")
    settings = directory / "flight.parm"
    own = "".join(f"{name} {value:g}\n" for name, value in more.items())
    settings.write_text((HERE / parameters).read_text() + own)
    command = [program, "--model", model, "--speedup", "1", "--home", HOME, "--defaults", settings, "--wipe"]
    command += ["--serial1", companion_port]
    with (directory / "simulator.log").open("w") as log:
        process = subprocess.Popen(
            [*map(str, command)], cwd=directory, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT
        )
        with contextlib.suppress(PermissionError):  # an autopilot does not wait for other programs
            os.sched_setscheduler(process.pid, os.SCHED_RR, os.sched_param(PRIORITY))
        try:
            yield
        finally:
            process.terminate()
            process.wait(10)


class Ground:
    """A ground station on the vehicle's first port. Keeps attitudes, texts and the newest message of each kind."""

    guided: ClassVar[int] = 4
    """Number of the mode GUIDED."""

    def __init__(self, log: Path, link: str = GROUND) -> None:
        self.attitudes: list[tuple[float, float, float, float]] = []
        self.telemetry: list[tuple[float, ...]] = []
        self.texts: list[tuple[float, int, str]] = []
        self.newest: dict[str, object] = {}
        self.parameters: dict[tuple[int, str], float] = {}
        self._link = mavutil.mavlink_connection(link, source_system=255, source_component=190, dialect="ardupilotmega")
        self._link.setup_logfile(str(log))
        self._open = True
        self._beat = 0.0
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._open = False
        self._thread.join(5)
        self._link.close()

    def _listen(self) -> None:
        while self._open:
            if time.monotonic() >= self._beat:
                self._beat = time.monotonic() + 1.0
                self._link.mav.heartbeat_send(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            message = self._link.recv_match(blocking=True, timeout=0.2)
            if message is not None:
                self._take(message)

    def _take(self, message) -> None:
        kind, sender = message.get_type(), message.get_srcComponent()
        if sender == mav.MAV_COMP_ID_AUTOPILOT1:
            self.newest[kind] = message
        if kind == "ATTITUDE":
            self.attitudes.append((message.time_boot_ms * 1e-3, message.roll, message.pitch, message.yaw))
        elif kind == "STATUSTEXT":
            self.texts.append((time.monotonic(), sender, message.text))
        elif kind == "PARAM_VALUE":
            self.parameters[sender, message.param_id] = message.param_value
        elif kind == "DEBUG_FLOAT_ARRAY" and message.name == "DOB":
            self.telemetry.append((message.time_usec * 1e-6, *message.data[:9]))

    def wait(self, what: str, condition, seconds: float = PATIENCE_S, every: float = 0.05, nudge=None) -> None:
        """Wait until `condition()` holds, calling `nudge()` once a second. Raises TimeoutError that names `what`."""
        deadline, next_nudge = time.monotonic() + seconds, 0.0
        while not condition():
            if time.monotonic() >= deadline:
                raise TimeoutError(
                    f"{what}: not within {seconds:g} s; heard {[text for _, _, text in self.texts[-5:]]}"
                )
            if nudge and time.monotonic() >= next_nudge:
                next_nudge = time.monotonic() + 1.0
                nudge()
            time.sleep(every)

    def command(self, number: int, *values: float) -> None:
        """COMMAND_LONG to the autopilot."""
        self._link.mav.command_long_send(1, 1, number, 0, *(*values, *[0.0] * (7 - len(values))))

    def write(self, name: str, value: float, component: int = 1) -> None:
        """PARAM_SET, without waiting."""
        self._link.mav.param_set_send(1, component, name.encode(), value, mav.MAV_PARAM_TYPE_REAL32)

    def set(self, name: str, value: float, component: int = 1) -> None:
        """PARAM_SET until its echo has come."""
        self.parameters.pop((component, name), None)
        self.wait(
            f"{name} = {value:g}",
            lambda: math.isclose(self.parameters.get((component, name), math.nan), value, rel_tol=1e-6, abs_tol=1e-7),
            nudge=lambda: self.write(name, value, component),
        )

    def disturb(self, accelerations: dict[int, float]) -> None:
        """Turn the vehicle about these axes (0 roll, 1 pitch, 2 yaw), angular acceleration in rad/s²."""
        for axis, value in accelerations.items():
            self.write(f"SIM_TWIST_{'XYZ'[axis]}", value)

    def fly(self, altitude_m: float = 20.0) -> None:
        """Arm in GUIDED as soon as the vehicle can, take off, wait until it hovers."""
        self.wait("heartbeat", lambda: "HEARTBEAT" in self.newest)
        self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_ATTITUDE, ATTITUDE_US)
        self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 200_000)
        for name, value in SCRIPT_PARAMETERS.items():
            self.set(name, value)
        self.set_mode("GUIDED", self.guided)
        self.wait("armed", self._armed, nudge=lambda: self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1))
        self.wait(
            "take-off",
            lambda: self.altitude > 1.0,
            nudge=lambda: self.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, altitude_m),
        )
        self.wait("altitude", lambda: abs(self.altitude - altitude_m) < 0.3)
        self._let_be_disturbed()

    def _let_be_disturbed(self) -> None:
        """What has to be set once so that `disturb` lasts."""
        self.set("SIM_TWIST_TIME", LARGEST_TWIST_MS)

    @property
    def altitude(self) -> float:
        """Height above home, m."""
        position = self.newest.get("GLOBAL_POSITION_INT")
        return position.relative_alt * 1e-3 if position else 0.0

    def _mode(self) -> int:
        beat = self.newest.get("HEARTBEAT")
        return beat.custom_mode if beat else -1

    def set_mode(self, name: str, mode: int) -> None:
        """Set a mode, until the vehicle is in it."""
        self.wait(
            name,
            lambda: self._mode() == mode,
            nudge=lambda: self._link.mav.set_mode_send(1, mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, mode),
        )

    def _armed(self) -> bool:
        beat = self.newest.get("HEARTBEAT")
        return bool(beat and beat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)


@contextlib.contextmanager
def companion(design: Path, directory: Path, *more: object, link: str = COMPANION_LINK) -> Iterator[subprocess.Popen]:
    """`dob-companion run` on the companion's port, its events in companion.jsonl, its flight recorded."""
    command = [sys.executable, "-m", "dob_companion", "run", "--design", design, "--link", link, "--json"]
    with (directory / "companion.jsonl").open("a") as log:
        process = subprocess.Popen(
            [*map(str, (*command, *more))], cwd=ROOT, stdout=log, stderr=log, env=os.environ | {"PYTHONUNBUFFERED": "1"}
        )
        with contextlib.suppress(PermissionError):  # on board it has a computer of its own
            os.setpriority(os.PRIO_PROCESS, process.pid, -15)
        try:
            yield process
        finally:
            process.terminate()
            process.wait(10)

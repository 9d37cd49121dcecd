"""Who does what, when: the demo as a sequence of acts."""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from subprocess import Popen
from typing import Any

from dob_companion.artifact import DobDesign, dumps
from dob_companion.demo.processes import child, free_udp_ports, last_line, stop
from dob_companion.demo.screen import Screen
from dob_companion.errors import FlightFailedError, NoVehicleError
from dob_companion.files import make_directory, read_bytes, read_text, reader_beside, remove, write_bytes, write_text
from dob_companion.ground import GroundStation
from dob_companion.report.flight_page import flight_page
from dob_companion.report.hero import hero_png
from dob_companion.report.trace import FlightTrace
from dob_companion.runtime.urls import LinkUrl
from dob_companion.synthesis import design_from_toml

CONNECT_S = 5.0
START_S = 300.0
"""How long the vehicle may take to be there: a nonlinear one is compiled and flies its disturbance in process first."""

TURN_S = 0.1


RESULTS = ("design.json", "flight.npz", "result.json", "report.html", "flight.png")
"""What a demo leaves in its directory, beside two logs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Demo:
    """What to fly: the spec, where results go, the seed, whether the clock is lockstep, the vehicle's scenario by name
    or path, and the link's delay in samples."""

    spec: Path
    out: Path
    seed: int
    fast: bool
    scenario: str = "paper"
    delay: int = 1

    @property
    def clock(self) -> str:
        """The vehicle's clock, by the name its command line knows."""
        return "lockstep" if self.fast else "real-time"


@dataclass(frozen=True, slots=True)
class Watched:
    """A process of the flight and what it writes. With a `verdict` there, ending with 1 is an answer, not a failure."""

    name: str
    process: Popen[bytes]
    log: Path
    verdict: Path | None = None

    def running(self) -> bool:
        """Whether it still runs. Raises FlightFailedError when it has ended with anything but success."""
        code = self.process.poll()
        if code == 1 and self.verdict is not None and self.verdict.exists():
            return False
        if code:
            raise FlightFailedError(f"{self.name} ended with exit code {code}: {last_line(self.log)} (see {self.log})")
        return code is None


def fly_demo(demo: Demo, screen: Screen) -> tuple[dict[str, Any], int]:
    """Design, fly, switch, evaluate. Returns result.json's object and the delay designed for; DIR holds all files.

    A flight that misses checks of its scenario is complete, and its result says so. Raises FlightFailedError when a
    process ends before the flight is complete.
    """
    design = fly(demo, screen)
    result: dict[str, Any] = json.loads(read_text(demo.out / "result.json"))
    screen.act("report", "drawing the figures of this flight")
    trace = FlightTrace.from_bytes(read_bytes(demo.out / "flight.npz"), str(demo.out / "flight.npz"))
    write_text(demo.out / "report.html", flight_page(design, result, trace))
    write_bytes(demo.out / "flight.png", hero_png(trace, result))
    screen.done()
    return result, design.delay_samples


def fly(demo: Demo, screen: Screen) -> DobDesign:
    """The demo without its report: design.json, flight.npz and result.json. Raises FlightFailedError."""
    make_directory(demo.out)
    for name in RESULTS:  # none of an earlier flight stands beside this one's
        remove(demo.out / name)
    design = _design(demo, screen)
    _fly(demo, screen)
    return design


def _design(demo: Demo, screen: Screen) -> DobDesign:
    screen.act("design", f"solving the H-infinity problem of {demo.spec.name}")
    created = datetime.now(UTC).isoformat(timespec="seconds")
    text, design = dumps(design_from_toml(read_text(demo.spec), str(demo.spec), created, reader_beside(demo.spec)))
    write_text(demo.out / "design.json", text)
    screen.certificate(design)
    return design


def _fly(demo: Demo, screen: Screen) -> None:
    companion_port, ground_port = free_udp_ports(2)
    screen.act("flight", f"vehicle and companion as two processes over UDP, {demo.clock}")
    companion_log, vehicle_log = demo.out / "companion.log", demo.out / "vehicle.log"
    companion_url = f"udpin:127.0.0.1:{companion_port}"
    vehicle_arguments = [demo.scenario, "--clock", demo.clock, "--seed", str(demo.seed), "--await-arming"]
    vehicle_arguments += ["--delay", str(demo.delay)]
    vehicle_arguments += ["--link", f"udpout:127.0.0.1:{companion_port}", "--gcs", f"udpout:127.0.0.1:{ground_port}"]
    vehicle_arguments += ["-o", str(demo.out)]
    design = str(demo.out / "design.json")
    with (
        child("dob_companion", ["run", "--design", design, "--link", companion_url], companion_log) as companion,
        child("sitl", vehicle_arguments, vehicle_log) as vehicle,
    ):
        flying = (
            Watched("vehicle", vehicle, vehicle_log, demo.out / "result.json"),
            Watched("companion", companion, companion_log),
        )
        with _connected(LinkUrl("udpin", "127.0.0.1", ground_port), *flying) as station:
            _serve_ground(station, screen, *flying)
        if stop(companion) != 0:
            raise FlightFailedError(f"companion: {last_line(companion_log)} (see {companion_log})")
    screen.note(last_line(companion_log).partition("info")[2].strip())


def _connected(url: LinkUrl, *flying: Watched) -> GroundStation:
    """A ground station that has heard the vehicle, which first works out how strong its disturbance must be."""
    give_up = time.monotonic() + START_S
    while True:
        try:
            return GroundStation(url, CONNECT_S)
        except NoVehicleError:
            if time.monotonic() > give_up or not all(each.running() for each in flying):
                raise


def _serve_ground(station: GroundStation, screen: Screen, vehicle: Watched, companion: Watched) -> None:
    """Do as the vehicle announces, until it has flown to the end."""
    duties: dict[str, Callable[[], None]] = {
        "sitl: waiting for arm": station.arm,
        "sitl: waiting for takeoff": station.take_off,
        "sitl: waiting for DOB_ENABLE=1": lambda: station.set_parameter("DOB_ENABLE", 1.0),
    }
    newest = ""
    while vehicle.running():
        companion.running()
        for text in station.texts_until(time.monotonic() + TURN_S):
            if text != newest:
                screen.text(text)
            newest = text
            duties.pop(text, lambda: None)()
        screen.telemetry(station.telemetry)

"""One flight of a design: vehicle and companion as two processes, and a ground station that does as it is asked."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from subprocess import Popen

from dob_companion.demo.processes import child, free_udp_ports, last_line, stop
from dob_companion.demo.screen import Screen
from dob_companion.errors import FlightFailedError, NoVehicleError
from dob_companion.ground import GroundStation
from dob_companion.runtime.urls import LinkUrl

CONNECT_S = 5.0
START_S = 300.0
"""How long the vehicle may take to be there: a nonlinear one is compiled and flies its disturbance in process first."""

TURN_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Sortie:
    """What is flown: the design, where the vehicle's results and both logs go, the scenario by name or path, the
    link's delay in samples, and the aircraft file of a vehicle other than the scenario's own. `ports` are the
    companion's and the ground station's, any that are free without them; `drawn` leaves the vehicle's own figure. With
    `script` its moments are reported as ArduPilot's script reads them, and taken so."""

    design: Path
    out: Path
    scenario: str
    seed: int
    clock: str
    delay: int
    aircraft: Path | None = None
    ports: tuple[int, int] | None = None
    drawn: bool = True
    script: bool = False


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


def fly_sortie(sortie: Sortie, screen: Screen) -> None:
    """Fly it to its end: result.json, flight.npz and two logs are in its directory then. Raises FlightFailedError."""
    companion_port, ground_port = sortie.ports or free_udp_ports(2)
    companion_log, vehicle_log = sortie.out / "companion.log", sortie.out / "vehicle.log"
    companion_arguments = ["run", "--design", str(sortie.design), "--link", f"udpin:127.0.0.1:{companion_port}"]
    vehicle_arguments = [sortie.scenario, "--clock", sortie.clock, "--seed", str(sortie.seed), "--await-arming"]
    vehicle_arguments += ["--delay", str(sortie.delay)]
    vehicle_arguments += ["--link", f"udpout:127.0.0.1:{companion_port}", "--gcs", f"udpout:127.0.0.1:{ground_port}"]
    vehicle_arguments += ["-o", str(sortie.out)]
    vehicle_arguments += [] if sortie.drawn else ["--no-figure"]
    if sortie.script:
        vehicle_arguments += ["--moments", "read"]
    if sortie.aircraft is not None:
        vehicle_arguments += ["--aircraft", str(sortie.aircraft)]
    with (
        child("dob_companion", companion_arguments, companion_log) as companion,
        child("sitl", vehicle_arguments, vehicle_log) as vehicle,
    ):
        flying = (
            Watched("vehicle", vehicle, vehicle_log, sortie.out / "result.json"),
            Watched("companion", companion, companion_log),
        )
        with _connected(LinkUrl("udpin", "127.0.0.1", ground_port), screen, *flying) as station:
            _serve_ground(station, screen, *flying)
        if stop(companion) != 0:
            raise FlightFailedError(f"companion: {last_line(companion_log)} (see {companion_log})")
    screen.note(last_line(companion_log).partition("info")[2].strip())


def _connected(url: LinkUrl, screen: Screen, *flying: Watched) -> GroundStation:
    """A ground station that has heard the vehicle, which first works out how strong its disturbance must be."""
    give_up = time.monotonic() + START_S
    while True:
        try:
            return GroundStation(url, CONNECT_S, lambda: screen.telemetry(None))
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

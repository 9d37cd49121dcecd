"""Flying the members: each in two processes on a link of their own, as many at once as the machine has cores."""

import io
import json
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

from dob_companion.artifact import AXES, DobDesign, loads
from dob_companion.demo.processes import free_udp_ports
from dob_companion.demo.scenario import told_by_vehicle
from dob_companion.demo.screen import Silent
from dob_companion.demo.sortie import Sortie, fly_sortie
from dob_companion.errors import FlightFailedError, InputError, NoVehicleError, RefusedError
from dob_companion.files import make_directory, read_bytes, read_text, reader_beside, remove, write_text
from dob_companion.ground import Telemetry
from dob_companion.mavlink.makes import ARDUPILOT
from dob_companion.rehearsal.members import Member, members, scenario_text
from dob_companion.rehearsal.verdict import Outcome
from dob_companion.report.trace import WINDOWS
from dob_companion.supervisor import State
from dob_companion.synthesis import Spec, parse_spec

FILES = ("aircraft.json", "result.json", "flight.npz", "vehicle.log", "companion.log")
"""What each member leaves in its directory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rehearsal:
    """Where design.json and perhaps spec.toml and identification.json lie, where results go, the seed of disturbance
    and noise, and whether ArduPilot's script is to report the moments whatever identification.json says."""

    directory: Path
    out: Path
    seed: int = 1
    script: bool = False

    @property
    def scripted(self) -> bool:
        """Whether a script reports moments late and now and then: asked for, or ArduPilot was identified. Raises
        InputError for an identification.json that is none."""
        path = self.directory / "identification.json"
        if self.script or not path.exists():
            return self.script
        try:
            return bool(json.loads(read_text(path)).get("make") == ARDUPILOT)
        except (ValueError, AttributeError):
            raise InputError(f"{path}: expected what `dob-companion identify` writes") from None

    @property
    def design(self) -> Path:
        """The design that is flown."""
        return self.directory / "design.json"

    def of(self, member: Member) -> Path:
        """The directory of one member's flight."""
        return self.out / member.name.replace(" ", "-")


def rehearse(rehearsal: Rehearsal, progress: Callable[[str], None]) -> tuple[DobDesign, list[Outcome]]:
    """Fly the whole family in lockstep. `progress` hears a line whenever a flight is over.

    Raises DesignFileError or SpecError for files that cannot be read, FlightFailedError when the model itself cannot be
    flown; a member that fails is an outcome.
    """
    design = loads(read_text(rehearsal.design), str(rehearsal.design))
    spec = _spec(rehearsal.directory / "spec.toml")
    flown = members(design, _attitude_gain(rehearsal.design, spec))
    make_directory(rehearsal.out)
    scenario = rehearsal.out / "rehearsal.toml"
    write_text(scenario, scenario_text(design, spec))
    ports = free_udp_ports(2 * len(flown))  # all at once, so that no two flights are given the same
    rehearsal = replace(rehearsal, script=rehearsal.scripted)
    jobs = {
        member.name: _prepared(rehearsal, member, scenario, design.delay_samples, (ports[2 * k], ports[2 * k + 1]))
        for k, member in enumerate(flown)
    }
    outcomes = dict(_flown(flown, jobs, progress))
    return design, [outcomes[member.name] for member in flown]


def _spec(path: Path) -> Spec | None:
    return parse_spec(read_text(path), str(path), reader_beside(path)) if path.exists() else None


def _attitude_gain(design: Path, spec: Spec | None) -> dict[str, float]:
    """By axis, 1/s: what the vehicle finds to fit around the model, and no more than the spec says."""
    found: Mapping[str, float] = told_by_vehicle(["calm", "--aircraft", str(design)])["aircraft"]["attitude_gain"]
    most = spec.auto.attitude_gain if spec and spec.auto and spec.auto.attitude_gain else float("inf")
    return {axis: min(found[axis], most) for axis in AXES}


def _prepared(rehearsal: Rehearsal, member: Member, scenario: Path, delay: int, ports: tuple[int, int]) -> Sortie:
    out = rehearsal.of(member)
    make_directory(out)
    for name in FILES:  # none of an earlier rehearsal stands beside this one's
        remove(out / name)
    write_text(out / "aircraft.json", json.dumps(member.aircraft) + "\n")
    return Sortie(
        design=rehearsal.design,
        out=out,
        scenario=str(scenario),
        seed=rehearsal.seed,
        clock="lockstep",
        delay=max(1, delay),
        aircraft=out / "aircraft.json",
        ports=ports,
        drawn=False,
        script=rehearsal.script,
    )


def _flown(
    flown: list[Member], jobs: Mapping[str, Sortie], progress: Callable[[str], None]
) -> Iterator[tuple[str, Outcome]]:
    """Outcomes as they come; Ctrl-C ends every flight before it goes on."""
    leave = Event()
    with ThreadPoolExecutor(min(len(flown), os.cpu_count() or 1)) as pool:
        try:
            running: set[Future[Outcome]] = {pool.submit(_fly, m, jobs[m.name], leave) for m in flown}
            while running:
                progress(f"{len(flown) - len(running)} of {len(flown)} aircraft flown")
                done, running = wait(running, return_when=FIRST_COMPLETED)
                yield from ((outcome.member.name, outcome) for outcome in (future.result() for future in done))
        finally:
            leave.set()
            pool.shutdown(cancel_futures=True)


class _Listener(Silent):
    """Hears why the observer went off, and ends the flight when it is to be left."""

    def __init__(self, leave: Event) -> None:
        self.reason = ""
        self._leave = leave

    def text(self, text: str) -> None:
        """Keep the reason of the newest fault or fade."""
        if text.startswith(("DOB FAULT: ", "DOB RAMP_OUT: ")):
            self.reason = text.partition(": ")[2]

    def telemetry(self, telemetry: Telemetry | None) -> None:  # noqa: ARG002
        """Leave if that is wanted."""
        if self._leave.is_set():
            raise FlightFailedError("interrupted")


def _fly(member: Member, sortie: Sortie, leave: Event) -> Outcome:
    listener = _Listener(leave)
    try:
        fly_sortie(sortie, listener)
        result: dict[str, Any] = json.loads(read_text(sortie.out / "result.json"))
    except (RefusedError, NoVehicleError) as failure:
        return Outcome(member=member, result=None, steady=False, said=listener.reason or str(failure))
    with np.load(io.BytesIO(read_bytes(sortie.out / "flight.npz"))) as trace:
        told = trace["state"][(trace["window"] == WINDOWS["on"]) & (trace["state"] >= 0)]
    steady = bool(len(told) and np.all(told == State.ACTIVE))
    return Outcome(member=member, result=result, steady=steady, said=listener.reason)

"""Who does what, when: the demo as a sequence of acts."""

import json
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dob_companion.artifact import DobDesign, dumps
from dob_companion.demo.screen import Screen
from dob_companion.demo.sortie import Sortie, fly_sortie
from dob_companion.files import make_directory, read_bytes, read_text, reader_beside, remove, write_bytes, write_text
from dob_companion.report.flight_page import flight_page
from dob_companion.report.hero import hero_png
from dob_companion.report.trace import FlightTrace
from dob_companion.synthesis import design_from_toml
from dob_companion.synthesis.tune.tuning import tuned_design_from_toml

RESULTS = ("design.json", "flight.npz", "result.json", "report.html", "flight.png")
"""What a demo leaves in its directory, beside two logs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Demo:
    """What to fly: the spec, where results go, the seed, whether the clock is lockstep, the vehicle's scenario by name
    or path, and the link's delay in samples. `auto` finds the weights by the spec's [auto] table; `own` flies the
    plant of the spec in place of the scenario's vehicle."""

    spec: Path
    out: Path
    seed: int
    fast: bool
    scenario: str = "paper"
    delay: int = 1
    auto: bool = False
    own: bool = False

    @property
    def clock(self) -> str:
        """The vehicle's clock, by the name its command line knows."""
        return "lockstep" if self.fast else "real-time"


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
    screen.act("flight", f"vehicle and companion as two processes over UDP, {demo.clock}")
    path = demo.out / "design.json"
    sortie = Sortie(
        design=path,
        out=demo.out,
        scenario=demo.scenario,
        seed=demo.seed,
        clock=demo.clock,
        delay=demo.delay,
        aircraft=path if demo.own else None,
    )
    fly_sortie(sortie, screen)
    return design


def _design(demo: Demo, screen: Screen) -> DobDesign:
    screen.act("design", f"solving the H-infinity problem of {demo.spec.name}")
    created = datetime.now(UTC).isoformat(timespec="seconds")
    asked = read_text(demo.spec), str(demo.spec), created, reader_beside(demo.spec)
    text, design = dumps(tuned_design_from_toml(*asked)[0] if demo.auto else design_from_toml(*asked))
    write_text(demo.out / "design.json", text)
    screen.certificate(design)
    return design

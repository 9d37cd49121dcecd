"""Command line of the simulated vehicle."""

import argparse
import gc
import json
import signal
import sys
from dataclasses import replace
from pathlib import Path

from sitl.attitude import Vector
from sitl.autopilot.own import OwnAircraft
from sitl.calibration import disturbance_scale
from sitl.console import program
from sitl.constants import AXES
from sitl.errors import FlightFailedError, InputError, SitlError
from sitl.extras import remedy
from sitl.flight import Flight
from sitl.links import Link, open_link, other_end
from sitl.result import verdicts, write
from sitl.run import Limits, Loop, fly_lockstep, fly_real_time, say
from sitl.scenario import checks
from sitl.scenario.own_aircraft import load_aircraft
from sitl.scenario.spec import Scenario, load, packaged_names
from sitl.wire.endpoint import COMPANION, GROUND, Endpoint
from sitl.wire.messages import IMU_FRAMES
from sitl.wire.reading import MOMENTS

LINK, GCS = "udpout:127.0.0.1:14540", "udpout:127.0.0.1:14550"
TAKE_OFF_S = 4.0
"""Roughly, to the altitude of most scenarios."""

_EXAMPLE = """\
example: the paper's comparison as fast as the machine goes, results in ./flight
  dob-companion run --design design.json --link udpin:127.0.0.1:14540 &
  python -m sitl paper --clock lockstep --seed 1 -o flight
your own aircraft, as a design knows it, in still air
  python -m sitl calm --aircraft my-design/design.json
"""


def parser() -> argparse.ArgumentParser:
    """The argument parser, also the source of `--help`."""
    p = argparse.ArgumentParser(
        prog="python -m sitl",
        description="A simulated quadrotor tail-sitter on two MAVLink links: the companion's and the ground station's.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    names = ", ".join(packaged_names())
    p.add_argument("scenario", nargs="?", default="calm", metavar="SCENARIO", help=f"{names}, or a .toml file (calm)")
    p.add_argument(
        "--aircraft",
        type=Path,
        metavar="FILE",
        help="fly the plant under the controllers of this design.json, on a link as slow as it is for",
    )
    p.add_argument("--clock", choices=("real-time", "lockstep"), default="real-time", help="default: %(default)s")
    p.add_argument("--seed", type=_seed, default=1, metavar="N", help="of disturbance and noise (%(default)s)")
    p.add_argument("--link", default=LINK, metavar="URL", help="the companion's link (%(default)s)")
    p.add_argument("--gcs", default=GCS, metavar="URL", help="the ground station's link (%(default)s)")
    p.add_argument(
        "--delay", type=_delay, metavar="N", help="of the companion's link, samples (1, or what FILE is for)"
    )
    p.add_argument(
        "--imu",
        choices=tuple(IMU_FRAMES),
        default="hover",
        help="frame that HIGHRES_IMU is in: forward-flight is a tail-sitter's (%(default)s)",
    )
    p.add_argument(
        "--moments",
        choices=MOMENTS,
        default="held",
        help="as they act, or as ArduPilot's script reads them: now and then (%(default)s)",
    )
    p.add_argument("-o", dest="directory", type=Path, metavar="DIR", help="result.json, flight.npz, figure.png go here")
    p.add_argument("--no-figure", action="store_true", help="draw none")
    p.add_argument("--await-arming", action="store_true", help="wait on the ground for ARM and TAKEOFF")
    p.add_argument("--about", action="store_true", help="print what SCENARIO is, as JSON, and fly nothing")
    p.add_argument("--timeout", type=_seconds, metavar="S", help="lockstep: longest wait for a companion (for ever)")
    p.add_argument("--event-timeout", type=_seconds, default=60.0, metavar="S", help="for awaited events (%(default)s)")
    return p


def _seed(text: str) -> int:
    value = int(text)
    if not 0 <= value < 2**32:
        raise argparse.ArgumentTypeError("expected a whole number from 0 to 2^32 - 1")
    return value


def _delay(text: str) -> int:
    value = int(text)
    if not 1 <= value <= 20:
        raise argparse.ArgumentTypeError("expected a whole number of samples from 1 to 20")
    return value


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 < value < 1e9:
        raise argparse.ArgumentTypeError("expected a positive number of seconds")
    return value


@program("sitl")
def main(arguments: list[str] | None = None) -> int:
    """Run; returns the exit code."""
    options = parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        return _fly(options)
    except SitlError as error:
        print(f"sitl: {error}", file=sys.stderr, flush=True)
        return error.exit_code
    except KeyboardInterrupt:
        print("sitl: interrupted", file=sys.stderr, flush=True)
        return 130


def _fly(options: argparse.Namespace) -> int:
    scenario, own = _what(options)
    if options.about:
        print(json.dumps(_about(scenario, own), ensure_ascii=False))
        return 0
    directory: Path | None = options.directory
    if directory is not None and directory.exists() and not directory.is_dir():
        raise InputError(f"-o {directory}: is a file; expected a directory")
    links: dict[str, Link] = {}
    try:
        links[COMPANION] = open_link(options.link)
        links[GROUND] = open_link(options.gcs)
        if own is not None:
            _introduce(own)
        scale = disturbance_scale(scenario, options.seed, own.build if own else None)
        if any(scale):
            say(_strength(scenario, scale))
        endless = scenario.windows is None
        record = directory is not None or not endless
        flight = Flight(
            scenario,
            options.seed,
            scale,
            await_arming=options.await_arming,
            aircraft=own.build() if own else None,
            record=record,
            delay_samples=options.delay or (max(1, own.delay_samples) if own else 1),
        )
        flight.vehicle.lockstep = options.clock == "lockstep"
        limits = Limits(options.timeout, None if endless else options.event_timeout)
        ends = {COMPANION: other_end(options.link), GROUND: other_end(options.gcs)}
        loop = Loop(Endpoint(flight, options.imu, options.moments), links, limits, ends)
        return _run(loop, options.clock, directory, drawn=not options.no_figure)
    finally:
        for link in links.values():
            link.close()


def _what(options: argparse.Namespace) -> tuple[Scenario, OwnAircraft | None]:
    """What is flown, and who flies if it is not the scenario's own vehicle.

    The checks of a packaged scenario and the paper's ratios are about the vehicles that come with it; what another
    aircraft must keep to stands in a scenario of its own.
    """
    scenario = load(options.scenario)
    if options.aircraft is None:
        return scenario, None
    own, clock = load_aircraft(options.aircraft)
    checks_of_it = () if options.scenario in packaged_names() else scenario.checks
    scenario = replace(
        scenario, airframe="linear", paper_ratio=None, checks=checks_of_it, clock=clock or scenario.clock
    )
    return scenario, own.settled()


def _introduce(own: OwnAircraft) -> None:
    gains = ", ".join(f"{name} {gain:.3g}" for name, gain in zip(AXES, own.attitude_gain or (), strict=True))
    say(f"aircraft of {own.source}; attitude gains of {gains} 1/s")
    if own.foreign:
        say(f"{own.source} says nothing of {', '.join(own.foreign)}: the paper's axes fly there")


def _about(scenario: Scenario, own: OwnAircraft | None) -> dict[str, object]:
    windows = scenario.windows
    flown_s = 2.0 * (windows.lead_s + windows.length_s) + windows.settle_s + TAKE_OFF_S if windows else None
    return {
        "scenario": scenario.name,
        "title": scenario.title,
        "airframe": scenario.airframe,
        "seconds": flown_s,  # null: it hovers until it is stopped
        "checks": len(scenario.checks),
        "aircraft": _about_aircraft(own) if own else None,
    }


def _about_aircraft(own: OwnAircraft) -> dict[str, object]:
    return {
        "attitude_gain": dict(zip(AXES, own.attitude_gain or (), strict=True)),
        "delay_samples": own.delay_samples,
        "axes": [name for name in AXES if name not in own.foreign],
    }


def _strength(scenario: Scenario, scale: Vector) -> str:
    disturbance = scenario.disturbance
    unit = "Nm" if disturbance and disturbance.moment else "normalized torque"
    kind = "at most" if disturbance and disturbance.pull else "rms"
    roll, pitch, yaw = scale
    return f"disturbance of roll {roll:.4f}, pitch {pitch:.4f}, yaw {yaw:.4f} {unit} {kind}"


def _run(loop: Loop, clock: str, directory: Path | None, *, drawn: bool) -> int:
    signal.signal(signal.SIGTERM, lambda *_: loop.stop())
    signal.signal(signal.SIGINT, lambda *_: loop.stop(interrupted=True))
    gc.freeze()  # what start-up left behind need not be looked through between samples
    say(f"{loop.flight.scenario.title}; {clock}")
    overruns = fly_lockstep(loop) if clock == "lockstep" else fly_real_time(loop)
    if overruns:
        say(f"{overruns} samples were late by more than one period")
    flight = loop.flight
    if directory is not None and (flight.complete or flight.scenario.windows is None):
        save(flight, clock, directory, drawn=drawn)
    if flight.complete:
        loop.finish()
        _judge(flight)
    return 130 if loop.interrupted else 0


def save(flight: Flight, clock: str, directory: Path, *, drawn: bool) -> None:
    """Write what the flight leaves behind; says so when there is nothing to draw the figure with."""
    try:
        write(flight, clock, directory, drawn=drawn)
    except ModuleNotFoundError as missing:
        say(f"no figure: {remedy(missing, 'design')}")


def _judge(flight: Flight) -> None:
    """Print the scenario's checks. Raises FlightFailedError when one does not hold."""
    found = verdicts(flight)
    if not found:
        return
    print("\n".join(checks.lines(found)), flush=True)
    failed = [verdict.name for verdict in found if not verdict.passed]
    if failed:
        raise FlightFailedError(f"{len(failed)} of {len(found)} checks failed: {', '.join(failed)}")

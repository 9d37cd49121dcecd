"""`dob-companion spec`: a design spec from the autopilot's own parameters."""

import argparse
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dob_companion.artifact import AXES
from dob_companion.errors import InputError, NoVehicleError

if TYPE_CHECKING:
    from dob_companion.autopilots import Autopilot, Parameters, Sourced
    from dob_companion.companion import Event
    from dob_companion.doctor.listening import Listening

RATE_HZ = 250.0
SECONDS = 3.0
"""How long the round trip is measured."""


def add_parser(commands: Any) -> None:
    """Add `spec` to the command line."""
    parser = commands.add_parser(
        "spec",
        help="a design spec from an autopilot's parameters",
        description="Write a design spec: controller and filters from the parameters of ArduPilot or PX4, read from a "
        "file or over MAVLink, the plant from the numbers given. The result is for `design --auto`.",
        epilog="example: dob-companion spec --params my.param --gain roll=306,pitch=307,yaw=14.5 -o my.toml",
    )
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--params", type=Path, metavar="FILE", help="parameter file of a ground station")
    source.add_argument("--link", metavar="URL", help="read them from the autopilot, and measure the round trip")
    parser.add_argument("--config", type=Path, metavar="FILE", help="that of `run`, with --link: its key to sign with")
    parser.add_argument("--state", type=Path, metavar="DIR", help="that of `run`: where signing timestamps are kept")
    parser.add_argument("-o", "--out", type=Path, metavar="SPEC.toml", help="the spec (standard output)")
    for option, what in (
        ("--gain", "angular acceleration per unit of torque, rad/s²"),
        ("--pole", "pole of the rate, rad/s (0: an integrator)"),
        ("--motor-ms", "time constant of the motors, ms (0)"),
        ("--delay-ms", "delay from torque to rate, ms (0)"),
    ):
        parser.add_argument(option, type=by_axis, action="append", default=[], metavar="AXIS=N", help=what)
    parser.add_argument("--delay", type=samples, metavar="N", help="delay_samples of the link (measured, or 2)")
    parser.add_argument("--noise-rms", type=_positive, metavar="N", help="gyro noise in hover, rad/s (0.0005)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read, write the spec or print it."""
    from dob_companion.autopilots import Aircraft, Sourced, parse_parameters, recognized, spec_text
    from dob_companion.files import read_text, write_text

    aircraft = Aircraft(
        gains=merged("--gain", args.gain, lambda x: x != 0.0, "a number that is not 0"),
        poles=merged("--pole", args.pole),
        motors_s=merged("--motor-ms", args.motor_ms, lambda x: x >= 0.0, "a number of 0 or more", 1e-3),
        delays_s=merged("--delay-ms", args.delay_ms, lambda x: 0.0 <= x <= 100.0, "a number from 0 to 100", 1e-3),
    )
    listening = None
    if args.params is not None:
        parameters = parse_parameters(read_text(args.params), str(args.params))
        autopilot = recognized(parameters)
    else:
        listening, autopilot, parameters = _asked(args.link, args.config, args.state)
    noise = (
        Sourced(5e-4, "assumed: measure it in hover") if args.noise_rms is None else Sourced(args.noise_rms, "given")
    )
    text = spec_text(
        autopilot,
        parameters,
        aircraft,
        rate_hz=RATE_HZ,
        delay_samples=_delay(args.delay, autopilot, listening),
        noise_rms=noise,
    )
    if args.out is None:
        sys.stdout.write(text)
    else:
        write_text(args.out, text)
        print(f"written: {args.out}")
    without = [axis for axis in AXES if axis not in aircraft.gains and "" not in aircraft.gains]
    if without:
        _note(f"no gain of {', '.join(without)} yet: `design` refuses the spec until num is filled in (--gain)")
    return 0


def _asked(link: str, config: Path | None, state: Path | None) -> "tuple[Listening, Autopilot, Parameters]":
    """Listen to the autopilot on the link and read what `spec` needs. Raises NoVehicleError, InputError."""
    import time
    from contextlib import ExitStack

    from dob_companion.autopilots import Parameters, autopilot_of, single
    from dob_companion.cli.daemon import configured
    from dob_companion.cli.signing import open_signing
    from dob_companion.doctor.listening import Listening, Stage
    from dob_companion.runtime import open_link, parse_link_url
    from dob_companion.runtime.listen import listen
    from dob_companion.runtime.signed import SignedLink

    def names(make: str, vehicle: str) -> tuple[str, ...]:
        known = autopilot_of(make, vehicle)
        return known.names if known else ()

    def tell(stage: Stage) -> None:
        if sys.stderr.isatty() and stage is not Stage.DONE:
            print(f"{url}: {stage.value} …", file=sys.stderr, flush=True)

    url = parse_link_url(link)
    settings, _ = configured(config, state, None)

    def say(event: "Event") -> None:
        _note(event.text)

    with ExitStack() as leaving:
        port = open_link(url)
        leaving.callback(port.close)
        signing = open_signing(settings, say, _note, leaving, datagrams=url.datagrams)
        if signing is not None:
            port = SignedLink(port, signing.gate)
        listening = Listening(1.0 / RATE_HZ, SECONDS, None, now=time.monotonic(), datagrams=url.datagrams, wanted=names)
        listen(listening, port, tell, say)
    presence = listening.autopilot
    if presence is None:
        raise NoVehicleError(f"{url}: no autopilot was heard (dob-companion doctor --link {url} tells more)")
    autopilot = autopilot_of(presence.make, presence.vehicle)
    if autopilot is None:
        raise InputError(f"{url}: the autopilot's make is {presence.make}; expected ArduPilot, PX4 or generic")
    if not listening.parameters:
        raise NoVehicleError(f"{url}: {autopilot.name} does not answer PARAM_REQUEST_READ; is signing on?")
    version = f" {listening.version}" if listening.version else ""
    values = {name: single(value) for name, value in listening.parameters.items()}
    return listening, autopilot, Parameters(f"{autopilot.name}{version} on {url}", values)


def _delay(given: int | None, autopilot: "Autopilot", listening: "Listening | None") -> "Sourced":
    from dob_companion.autopilots import Sourced
    from dob_companion.supervisor import percentile
    from dob_companion.supervisor.monitors import LATE

    least = autopilot.delay_samples
    if given is not None:
        return Sourced(given, "given")
    trips = listening.round_trips_s if listening is not None else ()
    if not trips:
        return Sourced(least, f"least for {autopilot.name}; not measured: spec --link measures the round trip")
    late = percentile(trips, LATE)
    samples = max(least, 1 + math.floor(late * RATE_HZ))
    return Sourced(samples, f"TIMESYNC round trip {1e3 * late:.1f} ms at 95 %, {least} at least for {autopilot.name}")


def merged(
    option: str,
    given: list[dict[str, float]],
    fits: Callable[[float], bool] = math.isfinite,
    expected: str = "",
    unit: float = 1.0,
) -> dict[str, float]:
    """What was given by axis, in SI units. Raises InputError that names option and axis."""
    values: dict[str, float] = {}
    for each in given:
        for axis, value in each.items():
            if not fits(value):
                raise InputError(f"{option} {axis or 'of all axes'}: {value:g}, expected {expected}")
            values[axis] = unit * value
    return values


def by_axis(text: str) -> dict[str, float]:
    """roll=306,pitch=307, or a number for all axes."""
    values = {}
    for part in text.split(","):
        axis, separator, number = part.rpartition("=")
        value = _finite(number)
        if value is None or (bool(separator) and axis not in AXES):
            raise argparse.ArgumentTypeError(f"{part!r}, expected AXIS=NUMBER with {', '.join(AXES)}, or a number")
        values[axis] = value
    return values


def _finite(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _positive(text: str) -> float:
    value = _finite(text)
    if value is None or value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a number above 0")
    return value


def samples(text: str) -> int:
    """delay_samples of a link, as argparse reads it."""
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= 30:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a whole number from 1 to 30")
    return int(text)


def _note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)

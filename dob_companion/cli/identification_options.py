"""What `identify` and `tune` may be told of a log. Light: it is imported for every `--help`."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from dob_companion.artifact import AXES
from dob_companion.cli.excite import EXCITED_S, add_excitation
from dob_companion.cli.spec import samples

RATE_HZ = 250.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """axes: those wanted; parameters: a ground station's file, in place of those in the log; controller: a spec whose
    controllers are taken; delay: of the link, samples, in place of what is known of the autopilot."""

    axes: tuple[str, ...] = AXES
    rate_hz: float = RATE_HZ
    parameters: Path | None = None
    controller: Path | None = None
    delay: int | None = None


def add_source(parser: argparse.ArgumentParser, *, seconds: float = EXCITED_S) -> None:
    """A log, or an aircraft that is excited first, `seconds` an axis unless told otherwise."""
    source = parser.add_mutually_exclusive_group(required=True)
    what = "of PX4, ArduPilot, a ground station, or a table; again for another flight of the same aircraft, newest last"
    source.add_argument("--log", type=Path, action="append", metavar="FILE", help=what)
    source.add_argument("--link", metavar="URL", help="excite the aircraft on this link first (dob-companion excite)")
    add_excitation(parser.add_argument_group("excitation, with --link"), seconds=seconds)


def add_options(parser: argparse.ArgumentParser) -> None:
    """What `of_logs` may be told."""
    parser.add_argument("--axis", action="append", choices=AXES, help="this axis alone; may be repeated (all)")
    parser.add_argument("--params", type=Path, metavar="FILE", help="parameter file, in place of those in the log")
    parser.add_argument("--controller", type=Path, metavar="SPEC.toml", help="take the rate controllers from this spec")
    parser.add_argument("--delay", type=samples, metavar="N", help="delay_samples of the link (by the autopilot)")


def options_of(args: argparse.Namespace) -> Options:
    """From the command line."""
    return Options(
        axes=tuple(axis for axis in AXES if axis in args.axis) if args.axis else AXES,
        parameters=args.params,
        controller=args.controller,
        delay=args.delay,
    )

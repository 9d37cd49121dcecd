"""`dob-companion identify`: from a log, or from an aircraft in hover, to a model and a spec."""

import argparse
import json
from pathlib import Path
from typing import Any

from dob_companion.cli.identification_options import add_options, add_source, options_of

EXIT_NOT_USABLE = 1


def add_parser(commands: Any) -> None:
    """Add `identify` to the command line."""
    parser = commands.add_parser(
        "identify",
        help="a model and a spec from a log or a hovering aircraft",
        description="Estimate the plant of each axis, torque to rate, from a log of PX4 or ArduPilot, a telemetry log, "
        "a recorded flight or a table, or excite a hovering aircraft and record it first. Writes spec.toml for "
        "`design --auto`, identification.html and identification.json.",
        epilog="example: dob-companion identify --log flight.bin -o my-aircraft",
    )
    add_source(parser)
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="where the results go")
    add_options(parser)
    parser.add_argument("--json", action="store_true", help="print the results as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Identify, write, print. Exit code 1 when no axis is usable."""
    from dob_companion.cli.identifying import logs_of, of_logs, table
    from dob_companion.files import require_place

    require_place(args.out)
    code, logs = logs_of(args, args.out)
    if code:
        return code
    outcome = of_logs(logs, options_of(args), args.config)
    written = outcome.write(args.out)
    if args.json:
        print(json.dumps(outcome.to_object()))
    else:
        print(f"{table(outcome)}\n\nwritten: {', '.join(map(str, written))}")
    return 0 if outcome.found.usable else EXIT_NOT_USABLE

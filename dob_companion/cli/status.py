"""`dob-companion status`: what the companion does now, as a ground station sees it."""

import argparse
import json
import time
from dataclasses import asdict
from typing import Any

from dob_companion.cli.param import add_station_arguments, station_url
from dob_companion.cli.times import utc
from dob_companion.errors import NoVehicleError


def add_parser(commands: Any) -> None:
    """Add `status` to the command line."""
    parser = commands.add_parser(
        "status",
        help="state, rate, delay and estimate of a running companion",
        description="State, rate, delay, estimate and correction of a running companion, through the vehicle.",
        epilog="example: dob-companion status --json",
    )
    add_station_arguments(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Wait for one telemetry message and print it."""
    from dob_companion.ground import GroundStation
    from dob_companion.supervisor import State
    from dob_companion.supervisor.monitors import UNKNOWN_AGE

    url = station_url(args.link)

    with GroundStation(url, args.timeout) as station:
        deadline = time.monotonic() + args.timeout
        while station.telemetry is None and time.monotonic() < deadline:
            for _ in station.texts_until(min(deadline, time.monotonic() + 0.05)):
                pass
        seen = station.telemetry
    if seen is None:
        raise NoVehicleError(f"link {url}: the vehicle is there, its companion said nothing within {args.timeout:g} s")
    if args.json:
        print(json.dumps({"time": utc()} | asdict(seen) | {"state": State(seen.state).name}))
        return 0
    rows = (("roll", 0), ("pitch", 1), ("yaw", 2))
    delay = f"{seen.delay_samples} samples" if seen.delay_samples < UNKNOWN_AGE else "unknown"
    print(f"{State(seen.state).name}   {seen.rate_hz:.1f} Hz   delay {delay}")
    print(f"{'axis':8}{'d_hat':>10}{'correction':>12}   normalized torque")
    print("\n".join(f"{name:8}{seen.d_hat[i]:>+10.4f}{seen.correction[i]:>+12.4f}" for name, i in rows))
    return 0

"""`dob-companion demo`: the main job in one go."""

import argparse
import json
import signal
from importlib.resources import files
from pathlib import Path
from typing import Any

from dob_companion.errors import InputError

SPEC_NAME = "tailsitter_paper.toml"
EXIT_TERMINATED = 128 + signal.SIGTERM
FLIGHT_S = 78.0
"""Rough length of the flight, for the progress bar only: take-off, two windows of 30 s with their leads, a rest."""


def add_parser(commands: Any) -> None:
    """Add `demo` to the command line."""
    parser = commands.add_parser(
        "demo",
        help="design, fly and switch the paper's observer in one go",
        description="Design the paper's observer, fly it on a simulated tail-sitter over MAVLink, switch it on in "
        "mid-flight, and compare. Results go to DIR: design.json, result.json, report.html, flight.png, flight.npz.",
        epilog="example: dob-companion demo --fast -o /tmp/demo",
    )
    parser.add_argument("-o", "--out", type=Path, default=Path("dob-demo"), metavar="DIR", help="(%(default)s)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of disturbance and noise (%(default)s)")
    parser.add_argument("--fast", action="store_true", help="lockstep: as fast as the machine goes, repeatable")
    parser.add_argument("--spec", type=Path, metavar="FILE", help=f"design spec ({SPEC_NAME})")
    parser.add_argument("--json", action="store_true", help="print result.json instead of the table")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fly the demo and print its table."""
    from dob_companion.demo import Demo, fly_demo
    from dob_companion.demo.screen import screen_for
    from dob_companion.demo.table import result_table

    signal.signal(signal.SIGTERM, _leave)
    if args.seed < 0:
        raise InputError(f"--seed is {args.seed}, expected 0 or more")
    demo = Demo(args.spec or _example_spec(), args.out, args.seed, args.fast)
    screen = screen_for(FLIGHT_S)
    try:
        result, designed_delay = fly_demo(demo, screen)
    finally:
        screen.done()
    if args.json:
        print(json.dumps(result))
        return 0
    print(result_table(result, designed_delay))
    for name in ("report.html", "flight.png", "result.json", "design.json"):
        print(f"  {args.out / name}")
    return 0


def _leave(_number: int, _frame: object) -> None:
    """SIGTERM unwinds like Ctrl-C, so that no process is left behind."""
    raise SystemExit(EXIT_TERMINATED)


def _example_spec() -> Path:
    """The paper's spec, which the package brings along: in a checkout a link to the one among the examples."""
    return Path(str(files("dob_companion.demo") / SPEC_NAME))

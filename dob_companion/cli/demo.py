"""`dob-companion demo`: the main job in one go."""

import argparse
import json
import signal
from importlib.resources import files
from pathlib import Path
from typing import Any

from dob_companion.errors import FlightFailedError, InputError
from dob_companion.files import read_text, reader_beside

PAPER = "tailsitter_paper.toml"
TUNED = {1: "tailsitter_tuned.toml", 2: "tailsitter_tuned_2.toml", 3: "tailsitter_tuned_3.toml"}
"""By link delay, samples. The scenarios' checks are for these; the paper's weights fly the paper's scenario."""

EXIT_TERMINATED = 128 + signal.SIGTERM


def add_parser(commands: Any) -> None:
    """Add `demo` to the command line."""
    parser = commands.add_parser(
        "demo",
        help="design, fly and switch an observer in one go",
        description="Design the paper's observer, fly it on a simulated tail-sitter over MAVLink, switch it on in "
        "mid-flight, and compare; or fly another scenario with the observer tuned for its link, and its checks; or, "
        "with --spec, an aircraft of your own: the plant that the spec names, under its controllers. "
        "Results go to DIR: design.json, result.json, report.html, flight.png, flight.npz.",
        epilog="example: dob-companion demo --fast --spec examples/px4_sih.toml",
    )
    parser.add_argument("-o", "--out", type=Path, default=Path("dob-demo"), metavar="DIR", help="(%(default)s)")
    parser.add_argument("--scenario", default="paper", metavar="NAME", help="or a .toml file (%(default)s)")
    parser.add_argument("--delay", type=_delay, metavar="N", help="of the link, samples (1, or what --spec is for)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of disturbance and noise (%(default)s)")
    parser.add_argument("--fast", action="store_true", help="lockstep: as fast as the machine goes, repeatable")
    parser.add_argument("--spec", type=Path, metavar="FILE", help="design spec of what to fly (by scenario)")
    parser.add_argument("--json", action="store_true", help="print result.json instead of the tables")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fly the demo and print its tables."""
    from dob_companion.demo import Demo, fly_demo
    from dob_companion.demo.scenario import scenario_of
    from dob_companion.demo.screen import screen_for
    from dob_companion.demo.table import checks_table, missed_checks, result_table

    signal.signal(signal.SIGTERM, _leave)
    if args.seed < 0:
        raise InputError(f"--seed is {args.seed}, expected 0 or more")
    spec, delay, kind = _spec(args)
    scenario = scenario_of(args.scenario)
    demo = Demo(spec=spec, out=args.out, seed=args.seed, fast=args.fast, scenario=scenario.asked, delay=delay, **kind)
    screen = screen_for(scenario.seconds)
    try:
        result, designed_delay = fly_demo(demo, screen)
    finally:
        screen.done()
    missed = missed_checks(result)
    if args.json:
        print(json.dumps(result))
    else:
        print(result_table(result, designed_delay))
        if result["checks"] and (missed or args.scenario != "paper"):
            print(checks_table(result))
        for name in ("report.html", "flight.png", "result.json", "design.json"):
            print(f"  {args.out / name}")
    if missed:
        raise FlightFailedError(f"{len(missed)} of {len(result['checks'])} checks failed: {', '.join(missed)}")
    return 0


def _spec(args: argparse.Namespace) -> tuple[Path, int, dict[str, bool]]:
    """What to design, the link's delay (one follows the other), and what more `Demo` must know of the spec."""
    if args.spec is None:
        delay = args.delay or 1
        if delay not in TUNED:
            raise InputError(f"--delay is {delay}: tuned specs are for {_listed(TUNED)} samples; give one with --spec")
        return packaged(PAPER if (args.scenario, delay) == ("paper", 1) else TUNED[delay]), delay, {}
    from dob_companion.demo.vehicle import is_tailsitter, require_rate
    from dob_companion.synthesis import parse_spec

    spec = parse_spec(read_text(args.spec), str(args.spec), reader_beside(args.spec))
    require_rate(spec)
    own = not is_tailsitter(spec, parse_spec(read_text(packaged(PAPER)), PAPER))
    unweighted = any(block.disturbance is None for block in spec.blocks)
    return args.spec, args.delay or max(1, spec.delay_samples), {"auto": unweighted, "own": own}


def _listed(numbers: Any) -> str:
    *some, last = map(str, numbers)
    return f"{', '.join(some)} and {last}"


def _delay(text: str) -> int:
    if not (text.isdecimal() and 1 <= int(text) <= 20):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number of samples from 1 to 20")
    return int(text)


def _leave(_number: int, _frame: object) -> None:
    """SIGTERM unwinds like Ctrl-C, so that no process is left behind."""
    raise SystemExit(EXIT_TERMINATED)


def packaged(name: str) -> Path:
    """A spec that the package brings along, the same as the one among the examples (a test holds them together)."""
    return Path(str(files("dob_companion.demo") / name))

"""`dob-companion rehearse`: a design flown in simulation over its family of plants, before it flies."""

import argparse
import json
import signal
from pathlib import Path
from typing import Any

from dob_companion.errors import FlightFailedError
from dob_companion.files import read_bytes, require_place, write_files

EXIT_TERMINATED = 128 + signal.SIGTERM


def add_parser(commands: Any) -> None:
    """Add `rehearse` to the command line."""
    parser = commands.add_parser(
        "rehearse",
        help="fly a design in simulation over the family of plants that it is for",
        description="Fly DIR/design.json on the simulated vehicle over MAVLink, observer off and on: the plant it was "
        "designed for, each end of what its [block.uncertainty] says the plant may be instead, and the worst plant "
        "found. Usable means that each stays stable, the observer stays on, and off/on is 1 or more. Where DIR holds "
        "spec.toml, the weather of its [auto] table is flown. Ends with 1 when an aircraft fails.",
        epilog="example: dob-companion rehearse my-design",
    )
    parser.add_argument("directory", type=Path, metavar="DIR", help="what `design -o DIR` has left")
    parser.add_argument("-o", "--out", type=Path, metavar="DIR", help="where the results go (DIR/rehearsal)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of disturbance and noise (%(default)s)")
    parser.add_argument(
        "--script",
        action="store_true",
        help="moments as ArduPilot's script reads them, which is the rule where `identify` found an ArduPilot",
    )
    parser.add_argument("--json", action="store_true", help="print rehearsal.json instead of the table")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fly, write, print the table. Raises FlightFailedError when an aircraft fails, with all files written."""
    out = args.out or args.directory / "rehearsal"
    found, words, wrong = rehearse_into(args.directory, out, args.seed, script=args.script)
    print(json.dumps(found) if args.json else words)
    if wrong:
        raise FlightFailedError(wrong)
    return 0


def rehearse_into(
    directory: Path, out: Path, seed: int = 1, *, script: bool = False
) -> tuple[dict[str, Any], str, str]:
    """Fly the design in `directory` and write the results. Returns rehearsal.json's content, the table, and what went
    wrong, "" for nothing."""
    from dob_companion.cli.console import progress
    from dob_companion.rehearsal import Rehearsal, rehearsal_object, rehearsal_table, rehearse
    from dob_companion.rehearsal.verdict import failed, weakest
    from dob_companion.report.rehearsal_page import rehearsal_page
    from dob_companion.report.trace import FlightTrace

    signal.signal(signal.SIGTERM, _leave)
    rehearsal = Rehearsal(directory=directory, out=out, seed=seed, script=script)
    require_place(out)
    try:
        design, outcomes = rehearse(rehearsal, progress)
    finally:
        progress("")
    found = rehearsal_object(design, outcomes)
    traces = {}
    for outcome in {o.member.name: o for o in (outcomes[0], weakest(outcomes))}.values():
        if outcome.result is not None:
            path = rehearsal.of(outcome.member) / "flight.npz"
            traces[outcome.member.name] = FlightTrace.from_bytes(read_bytes(path), str(path))
    page = rehearsal_page(design, found, traces)
    text = json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    write_files(out, {"rehearsal.json": text, "report.html": page})
    words = [rehearsal_table(outcomes)]
    if len(outcomes) == 1:
        words.append("the design states no uncertainty: only the plant it was designed for was flown")
    words += [f"  {out / name}" for name in ("report.html", "rehearsal.json")]
    return found, "\n".join(words), failed(outcomes)


def _leave(_number: int, _frame: object) -> None:
    """SIGTERM unwinds like Ctrl-C, so that no process is left behind."""
    raise SystemExit(EXIT_TERMINATED)

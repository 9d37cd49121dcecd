"""`dob-companion report`: the page of a recorded flight, or of a design."""

import argparse
from pathlib import Path
from typing import Any


def add_parser(commands: Any) -> None:
    """Add `report` to the command line."""
    parser = commands.add_parser(
        "report",
        help="the page of a recorded flight, or of a design",
        description="Write a self-contained HTML page: of a recorded flight what the companion did, why, how the link "
        "was, and the body rates with the observer off and on; of a design.json its certificate and responses.",
        epilog="example: dob-companion report flights/flight-0007-000.dobtrace -o flight.html",
    )
    parser.add_argument(
        "source", type=Path, metavar="TRACE", help="a segment, a directory (its newest flight) or a design.json"
    )
    parser.add_argument("-o", "--out", type=Path, default=Path("report.html"), metavar="FILE", help="(%(default)s)")
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read, draw, write."""
    import json

    from dob_companion.files import write_text

    page, notes = _flight(args.source) if _is_recorded(args.source) else (_design(args.source), [])
    write_text(args.out, page)
    if args.json:
        print(json.dumps({"written": str(args.out), "notes": notes}))
        return 0
    print("\n".join([*notes, f"written: {args.out}"]))
    return 0


def _is_recorded(path: Path) -> bool:
    """Whether it is a recorded flight; a design else. Raises InputError for a file that is known to be neither."""
    from dob_companion.files.kinds import TRACE, kind_of, require_trace

    if path.is_dir():
        return True
    kind = kind_of(path)
    if kind not in (TRACE, ""):
        require_trace(path, " or a design.json")
    return kind == TRACE


def _design(path: Path) -> str:
    from dob_companion.artifact import loads
    from dob_companion.files import read_text
    from dob_companion.report.design_page import design_page

    return design_page(loads(read_text(path), str(path)))


def _flight(source: Path) -> tuple[str, list[str]]:
    from dob_companion.analysis.recorded import FlightReader
    from dob_companion.errors import InputError, placed
    from dob_companion.files.playback import play
    from dob_companion.files.segments import traces_at
    from dob_companion.report.recorded_page import recorded_page

    reader, notes = FlightReader(), []
    paths = traces_at(source)
    for path in paths:
        try:
            ending = play(path, reader)
        except InputError as problem:
            raise placed(problem, str(path)) from None
        if ending.torn:
            notes.append(f"{path}: ends in the middle of a write; what was whole was read")
        if ending.damage:
            notes.append(f"{path}: damaged, what stands before was read: {ending.damage}")
    name = paths[0].stem.rpartition("-")[0] if source.is_dir() else source.stem
    return recorded_page(reader.flight(str(source)), name), notes

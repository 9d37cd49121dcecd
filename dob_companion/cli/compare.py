"""`dob-companion compare`: the design beside other observers, on the same plant, link and weather."""

import argparse
import json
from pathlib import Path
from typing import Any

from dob_companion.cli.console import progress
from dob_companion.errors import InputError
from dob_companion.files import read_text, reader_beside, require_place, write_files

MOST_SEEDS = 1000


def add_parser(subparsers: Any) -> None:
    """Add `compare` to the command line."""
    parser = subparsers.add_parser(
        "compare",
        help="other observers on the same plant and disturbances",
        description="Design the spec's observer and six others (none, conventional, open-loop H-infinity, Kalman, "
        "extended-state, INDI), all tuned by one rule, and fly them through the same disturbances.",
        epilog="example: dob-companion compare examples/tailsitter_paper.toml -o my-comparison",
    )
    parser.add_argument("spec", type=Path, metavar="SPEC.toml", help="the design spec, single-axis blocks")
    parser.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="also write comparison.json, comparison.html, comparison.png"
    )
    parser.add_argument("--json", action="store_true", help="print comparison.json instead of the table")
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="flights of each observer (%(default)s)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Design, compare, print; write when asked to."""
    from dob_companion.comparison import compare, comparison_object, comparison_table
    from dob_companion.comparison.table import RULE
    from dob_companion.synthesis import design_from_toml
    from dob_companion.synthesis.numeric import numbers_judged

    if not 1 <= args.seeds <= MOST_SEEDS:
        raise InputError(f"--seeds is {args.seeds}, expected 1 to {MOST_SEEDS}")
    text = read_text(args.spec)
    if args.out:
        require_place(args.out)
    try:
        progress("designing")
        with numbers_judged(str(args.spec)):
            design = design_from_toml(text, str(args.spec), read=reader_beside(args.spec))
            axes = compare(design, args.seeds, str(args.spec), progress)
    finally:
        progress("")
    found = json.dumps(comparison_object(axes), ensure_ascii=False, indent=1)
    written = _write(args.out, found, axes, args.spec.name) if args.out else ()
    print(found if args.json else "\n\n".join([*map(comparison_table, axes), RULE]))
    if written and not args.json:
        print(f"\nwritten: {', '.join(written)}")
    return 0


def _write(out: Path, found: str, axes: Any, title: str) -> tuple[str, ...]:
    from dob_companion.report.comparison_page import comparison_page, comparison_png

    files: dict[str, str | bytes] = {
        "comparison.json": found + "\n",
        "comparison.html": comparison_page(axes, title),
        "comparison.png": comparison_png(axes[0]),
    }
    write_files(out, files)
    return tuple(str(out / name) for name in files)

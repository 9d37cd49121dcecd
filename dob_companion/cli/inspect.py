"""`dob-companion inspect`: verify a design again from its file alone."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dob_companion.artifact import DobDesign, check_flyable, loads
from dob_companion.errors import DesignFileError, DobError, placed
from dob_companion.files import read_text


def add_parser(subparsers: Any) -> None:
    """Add `inspect` to the command line."""
    parser = subparsers.add_parser(
        "inspect",
        help="verify a design.json again",
        description="Recompute every number of a certificate from the matrices in the file, and compare.",
        epilog="example: dob-companion inspect my-design/design.json",
    )
    parser.add_argument("design", type=Path, metavar="design.json", help="the design to verify")
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read, verify, print. Returns 1 when a recorded number is not what is measured, or it may not fly."""
    from dob_companion.synthesis import verify

    design = loads(read_text(args.design), str(args.design))
    try:
        findings = verify(design)
    except DobError as problem:
        raise placed(problem, str(args.design)) from problem
    unfit = _unfit(design, str(args.design))
    ok = all(finding.agrees for finding in findings) and not unfit
    if args.json:
        print(json.dumps({"verified": ok, "unfit": unfit, "findings": [asdict(finding) for finding in findings]}))
        return 0 if ok else 1
    for finding in findings:
        verdict = "ok" if finding.agrees else "DIFFERS"
        print(f"{finding.block:8} {finding.name:28} {finding.recorded:>14.8g} {finding.measured:>14.8g}  {verdict}")
    print(unfit or f"{args.design}: {'verified' if ok else 'NOT verified'} (sha256 {design.sha256[:8]})")
    return 0 if ok else 1


def _unfit(design: DobDesign, source: str) -> str:
    try:
        check_flyable(design, 1.0 / design.dt, source)
    except DesignFileError as reason:
        return str(reason)
    return ""

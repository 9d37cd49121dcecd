"""`dob-companion design`: from a spec to a certified design.json."""

import argparse
import json
import sys
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dob_companion.artifact import Certificate, DobDesign, dumps
from dob_companion.cli.robustness import robustness_words
from dob_companion.cli.tradeoff import tuning_object, tuning_table
from dob_companion.errors import SpecError
from dob_companion.files import make_directory, read_text, reader_beside, write_text

_ROWS = (
    ("order", "observer order", "{:d}"),
    ("gamma", "gamma (measured)", "{:.5f}"),
    ("gamma_star", "gamma_star (lower bound)", "{:.5f}"),
    ("closed_loop_spectral_radius", "closed-loop spectral radius", "{:.6f}"),
    ("observer_spectral_radius", "observer spectral radius", "{:.6f}"),
    ("slowest_mode_s", "slowest mode, s", "{:.4f}"),
    ("command_leak", "command leak", "{:.1e}"),
    ("disk_margin", "disk margin", "{:.3f}"),
    ("delay_margin_samples", "delay margin, samples", "{:d}"),
    ("estimation_bandwidth_hz", "estimation bandwidth, Hz", "{:.2f}"),
)


def add_parser(subparsers: Any) -> None:
    """Add `design` to the command line."""
    parser = subparsers.add_parser(
        "design",
        help="synthesize and certify an observer",
        description="Solve the H-infinity problem of a spec, certify the result, write design.json and report.html.",
        epilog="example: dob-companion design examples/tailsitter_paper.toml -o my-design",
    )
    parser.add_argument("spec", type=Path, metavar="SPEC.toml", help="the design spec")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="where the results go")
    parser.add_argument(
        "--auto",
        action="store_true",
        help="find the weights from the spec's [auto] table; print and draw the trade-off",
    )
    parser.add_argument("--order", type=_states, metavar="N", help="reduce each observer to at most N states")
    parser.add_argument("--json", action="store_true", help="print the certificates as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Design, write, print the certificate."""
    from dob_companion.report.design_page import design_report
    from dob_companion.synthesis import design_from_toml

    created = datetime.now(UTC).isoformat(timespec="seconds")
    spec = read_text(args.spec)
    if args.auto and args.order is not None:
        raise SpecError("--order: with --auto, put largest_order = N into the spec's [design] instead")
    if args.auto:
        found, tunings = _tuned(spec, args.spec, created)
    else:
        found, tunings = (
            design_from_toml(spec, str(args.spec), created, reader_beside(args.spec), largest_order=args.order),
            (),
        )
    text, design = dumps(found)
    make_directory(args.out)
    write_text(args.out / "design.json", text)
    page, figures = design_report(design, tunings)
    write_text(args.out / "report.html", page)
    make_directory(args.out / "figures")
    for name, picture in figures.items():
        write_text(args.out / "figures" / name, picture)
    if args.json:
        print(json.dumps(_objects(design, tunings)))
    else:
        findings = filter(None, map(robustness_words, design.blocks))
        print("\n\n".join([*map(tuning_table, tunings), certificate_table(design), *findings]))
        print(
            f"\nwritten: {args.out / 'design.json'} (sha256 {design.sha256[:8]}), {args.out / 'report.html'}, figures"
        )
    return 0


def _tuned(text: str, path: Path, created: str) -> tuple[DobDesign, tuple[Any, ...]]:
    from dob_companion.synthesis.tuning import tuned_design_from_toml

    try:
        return tuned_design_from_toml(text, str(path), created, _progress)
    finally:
        _progress("")


def _objects(design: DobDesign, tunings: tuple[Any, ...]) -> dict[str, Any]:
    """Certificates by block, each with its tuning when there was one."""
    objects = {block.name: certificate_object(block.certificate) for block in design.blocks}
    for tuning in tunings:
        objects[tuning.name]["tuning"] = tuning_object(tuning)
    return objects


def _progress(text: str) -> None:
    """What is at work, on one line of a terminal that the next replaces; nothing in a pipe."""
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def _states(text: str) -> int:
    order = int(text)
    if order < 1:
        raise ValueError
    return order


def certificate_object(certificate: Certificate) -> dict[str, Any]:
    """A certificate as it stands in design.json."""
    named = {f.name: getattr(certificate, f.name) for f in fields(Certificate) if f.name != "extra"}
    return named | dict(certificate.extra)


def certificate_table(design: DobDesign) -> str:
    """One column a block."""
    columns = []
    for block in design.blocks:
        values = certificate_object(block.certificate) | {"order": block.observer.order}
        columns.append([block.name, *(form.format(values[key]) for key, _, form in _ROWS)])
    labels = [f"{1 / design.dt:g} Hz, delay {design.delay_samples}", *(label for _, label, _ in _ROWS)]
    widths = [max(map(len, column)) for column in (labels, *columns)]
    lines = []
    for label, *cells in zip(labels, *columns, strict=True):
        aligned = (cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True))
        lines.append("  ".join([label.ljust(widths[0]), *aligned]))
    return "\n".join(lines)

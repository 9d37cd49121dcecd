"""`dob-companion design`: from a spec to a certified design.json."""

import argparse
import json
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dob_companion.artifact import Certificate, DobDesign, dumps
from dob_companion.files import make_directory, read_text, write_text

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
    parser.add_argument("--json", action="store_true", help="print the certificates as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Design, write, print the certificate."""
    from dob_companion.report.design_page import design_page
    from dob_companion.synthesis import design_from_toml

    created = datetime.now(UTC).isoformat(timespec="seconds")
    text, design = dumps(design_from_toml(read_text(args.spec), str(args.spec), created))
    make_directory(args.out)
    write_text(args.out / "design.json", text)
    write_text(args.out / "report.html", design_page(design))
    if args.json:
        print(json.dumps({block.name: certificate_object(block.certificate) for block in design.blocks}))
    else:
        print(certificate_table(design))
        print(f"\nwritten: {args.out / 'design.json'} (sha256 {design.sha256[:8]}), {args.out / 'report.html'}")
    return 0


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
